"""Stages: what a SLAM believed on the way, kept so small that hundreds of a long run fit."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid

FAST = 1  # the level of compression: a map of 100 x 60 m is packed in some 10 ms
UNSEEN = -1


@dataclass(frozen=True)
class MapSnapshot:
    """A SLAM's belief after one of its scans.

    poses   (scan + 1, 3) at each scan up to this one, as believed then
    spec    the map's cells
    packed  the map: h in whole percent, as ROS has it, compressed
    """

    poses: Array
    spec: GridSpec
    packed: bytes

    @staticmethod
    def of(poses: Array, grid: OccupancyGrid) -> MapSnapshot:
        """Pack a map that was believed together with poses (n, 3), n >= 1."""
        percent = np.where(grid.observed, np.rint(100.0 * grid.occupied), UNSEEN).astype(np.int8)
        return MapSnapshot(poses, grid.spec, zlib.compress(percent.tobytes(), FAST))

    @property
    def scan(self) -> int:
        """Number of the scan, from 0."""
        return len(self.poses) - 1

    @property
    def grid(self) -> OccupancyGrid:
        """The map, unpacked: h to the whole percent, 0.5 where nothing was seen."""
        cells = np.frombuffer(zlib.decompress(self.packed), np.int8).reshape(self.spec.shape)
        observed = cells != UNSEEN
        return OccupancyGrid(self.spec, np.where(observed, cells / 100.0, 0.5), observed)
