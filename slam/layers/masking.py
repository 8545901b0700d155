"""Areas of a map in which nothing is taken to stand, whatever was measured there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid
from slam.layers.classification import FREE, NO_REASON, UNKNOWN
from slam.layers.layers import Layers

MASKED = 0.5  # h of a mask's cell from which on it is masked


def masked_cells(spec: GridSpec, mask: OccupancyGrid) -> np.ndarray:
    """(rows, cols) bool: cells of the grid `spec` whose centre a mask holds to be occupied. The
    mask may have another size, place and resolution; outside of it nothing is masked."""
    cells = np.indices(spec.shape).reshape(2, -1).T
    return _in_mask(spec.centres(cells), mask).reshape(spec.shape)


def without_masked(layers: Layers, mask: OccupancyGrid) -> Layers:
    """The layers with cells in the mask free, if they were ever seen, and without doors whose
    middle lies in it."""
    inside = masked_cells(layers.spec, mask)
    seen = inside & (layers.kind != UNKNOWN)
    kind = np.where(seen, np.uint8(FREE), layers.kind)
    reason = np.where(inside, np.uint8(NO_REASON), layers.reason)
    middles = np.array([door.ends.mean(axis=0) for door in layers.doors]).reshape(-1, 2)
    gone = _in_mask(middles, mask)
    doors = tuple(door for door, out in zip(layers.doors, gone.tolist(), strict=True) if not out)
    return replace(layers, kind=kind, reason=reason, doors=doors)


def map_without_masked(grid: OccupancyGrid, mask: OccupancyGrid) -> OccupancyGrid:
    """A map with h 0 in all cells in the mask that were observed."""
    inside = masked_cells(grid.spec, mask) & grid.observed
    return replace(grid, occupied=np.where(inside, 0.0, grid.occupied))


def _in_mask(points: Array, mask: OccupancyGrid) -> np.ndarray:
    occupied, observed = mask.sample(points)
    return observed & (occupied >= MASKED)
