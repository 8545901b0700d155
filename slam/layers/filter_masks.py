"""Masks of Nav2's costmap filters: where a robot should not drive, and where slowly."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt

from slam.layers.classification import CHANGING, GLASS, SEEN_IN_PART, UNKNOWN
from slam.layers.layers import Layers
from slam.layers.regions import EIGHT_NEIGHBOURS

CLOSED, OPEN, NO_LIMIT, UNSEEN = 100, 0, 0, -1  # percent; UNSEEN: the filters do nothing there
DOOR_LIMIT, CHANGING_LIMIT = 50, 70  # percent of the speed, near doors and near what changed
BESIDE_DOOR = 0.5  # m beyond the sweep of a door's leaf in which its limit holds
BESIDE_CHANGING = 0.5  # m around cells that changed: people and furniture came and went there
CLOSED_MARGIN = 1  # cells around what only some beams hit


def keepout_mask(layers: Layers, keep: Collection[int]) -> np.ndarray:
    """(rows, cols) int16, percent: CLOSED where only some beams hit something that is kept (of the
    reasons `keep`), and beside it, OPEN elsewhere, UNSEEN in unknown cells.

    Glass, meshes and thin legs are in the map, but what the robot's own laser sees from near may
    clear them from its costmaps; this mask does not.
    """
    reasons = [one for one in (SEEN_IN_PART, GLASS) if one in keep]
    doubtful = layers.kept & np.isin(layers.reason, reasons)
    closed = binary_dilation(doubtful, EIGHT_NEIGHBOURS, CLOSED_MARGIN)
    return _percent(layers, [closed], [CLOSED], OPEN)


def speed_mask(layers: Layers) -> np.ndarray:
    """(rows, cols) int16, percent of the robot's speed: DOOR_LIMIT near the doors that were found,
    CHANGING_LIMIT near other cells that changed, NO_LIMIT elsewhere, UNSEEN in unknown cells."""
    doors = np.zeros(layers.spec.shape, np.bool_)
    for door in layers.doors:
        _disc(layers, door.ends.mean(axis=0), door.width + BESIDE_DOOR, doors)
    changing = layers.kind == CHANGING
    near = np.zeros_like(doors)
    if changing.any():
        away = np.asarray(distance_transform_edt(~changing)) * layers.spec.resolution
        near = away <= BESIDE_CHANGING
    return _percent(layers, [doors, near], [DOOR_LIMIT, CHANGING_LIMIT], NO_LIMIT)


def _percent(
    layers: Layers, areas: list[np.ndarray], values: list[int], elsewhere: int
) -> np.ndarray:
    unseen = layers.kind == UNKNOWN
    return np.select([unseen, *areas], [UNSEEN, *values], elsewhere).astype(np.int16)


def _disc(layers: Layers, middle: np.ndarray, radius: float, disc: np.ndarray) -> None:
    """Set the cells of `disc` (rows, cols) whose centres lie within `radius` (m) of a point."""
    spec = layers.spec
    low, high = spec.cells(np.array([middle - radius, middle + radius]))
    rows = np.arange(max(low[0], 0), min(high[0] + 1, spec.rows))
    cols = np.arange(max(low[1], 0), min(high[1] + 1, spec.cols))
    cells = np.array(np.meshgrid(rows, cols, indexing="ij")).reshape(2, -1).T
    near = np.hypot(*(spec.centres(cells) - middle).T) <= radius
    disc[tuple(cells[near].T)] = True
