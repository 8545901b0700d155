"""Maps from true poses, for tests of the sensor models."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.interface import MapModel
from slam.maps.tiles import Layer, Tiles
from slam.scan import Scan
from tests.slam.worlds import FAN, ROOM, loop, scan_at

CORNER = np.array([[-0.4, 0.62, 0.9, 0.62], [0.9, 0.62, 0.9, -0.5]])
"""Two walls, a small map."""


def mapped(grid, reading, poses=None, angles=FAN, walls=ROOM, noise=0.0):
    """A map of the walls; the sensor model is refreshed scan by scan."""
    rng = np.random.default_rng(5)
    for k, pose in enumerate(loop(20) if poses is None else poses):
        pose = Pose2.of(pose)
        scan = scan_at(pose, time=1.7 * k, angles=angles, walls=walls)
        scan = Scan(scan.ranges + rng.normal(0, noise, len(angles)), angles, 6.0, time=scan.time)
        reading.refresh(grid, grid.integrate(scan, pose))
    return grid, reading


def observed(grid: MapModel) -> np.ndarray:
    """The ids of all observed cells."""
    return np.flatnonzero(grid.cells.observed.flat)


def dense(tiles: Tiles, layer: Layer, side: int) -> np.ndarray:
    """A layer of (side, side) values a tile as one array."""
    rows, cols = tiles.index.shape
    squares = layer.values.reshape(-1, side, side)[tiles.index]
    return np.moveaxis(squares, 2, 1).reshape(rows * side, cols * side)


def around(truth: Pose2, step: float = 0.0125, turn_deg: float = 0.5, n: int = 8):
    """(m, 3) errors on a grid around a pose, in its frame."""
    steps = np.arange(-n, n + 1) * step
    turns = np.radians(np.arange(-n, n + 1) * turn_deg)
    return np.stack(np.meshgrid(steps, steps, turns), axis=-1).reshape(-1, 3)
