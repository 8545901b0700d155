"""Compressed snapshots of a SLAM's map and trajectory, small enough to keep hundreds of a run."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid

COMPRESSION_LEVEL = 1  # the fastest: a map of 100 x 60 m takes some 10 ms
UNSEEN = -1
SHARES = np.where(np.arange(256) <= 100, np.arange(256) / 100.0, 0.5)  # h, by percent as uint8


@dataclass(frozen=True)
class MapSnapshot:
    """The map and the trajectory after one of the scans.

    poses   (scan + 1, 3) at each scan up to this one, as estimated then
    spec    the map's cells
    packed  the map: h in whole percent, as ROS has it, compressed
    """

    poses: Array
    spec: GridSpec
    packed: bytes

    @staticmethod
    def of(poses: Array, grid: OccupancyGrid) -> MapSnapshot:
        """Compress a map, with the poses (n, 3), n >= 1, estimated at the same time."""
        percent = np.where(grid.observed, np.rint(100.0 * grid.occupied), UNSEEN).astype(np.int8)
        return MapSnapshot(poses, grid.spec, zlib.compress(percent.tobytes(), COMPRESSION_LEVEL))

    @property
    def scan(self) -> int:
        """Number of the scan, from 0."""
        return len(self.poses) - 1

    @property
    def percent(self) -> np.ndarray:
        """(rows, cols) int8: h in whole percent, UNSEEN in unobserved cells."""
        return np.frombuffer(zlib.decompress(self.packed), np.int8).reshape(self.spec.shape)

    @property
    def grid(self) -> OccupancyGrid:
        """The map, unpacked: h rounded to whole percent, 0.5 in unobserved cells."""
        cells = self.percent
        return OccupancyGrid(self.spec, SHARES[cells.view(np.uint8)], cells != UNSEEN)
