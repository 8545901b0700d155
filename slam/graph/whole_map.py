"""The global map: all keyframes of all local maps at the poses of the graph."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from slam.geometry import Array, Pose2, between
from slam.graph.local_map import LocalMap
from slam.grid import OccupancyGrid
from slam.interface import MapModel

MAX_SHIFT, MAX_TURN = 0.01, math.radians(0.2)  # m, rad, of a local map before the map is redone


class WholeMap:
    """One map of any model: extended while the local maps keep their poses, else built anew."""

    def __init__(self, map_model: Callable[[], MapModel]):
        self._make = map_model
        self._begin()

    def _begin(self) -> None:
        self._map_model = self._make()
        self._poses = np.zeros((0, 3))  # at which local maps were integrated
        self._keyframes: list[int] = []  # number of keyframes integrated of each

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles."""
        return self._map_model.cells.tiles.nbytes

    def map(self, places: Sequence[LocalMap], poses: Array) -> OccupancyGrid:
        """A copy of the map of the local maps `places` at `poses` (n, 3)."""
        moved = between(self._poses, poses[: len(self._poses)])
        if (np.hypot(moved[:, 0], moved[:, 1]) > MAX_SHIFT).any() or (
            np.abs(moved[:, 2]) > MAX_TURN
        ).any():
            self._begin()
        new = len(self._poses)
        self._poses = np.vstack([self._poses, poses[new : len(places)]])
        self._keyframes += [0] * (len(places) - new)
        for number in range(max(new - 1, 0), len(places)):
            frame = Pose2.of(self._poses[number])
            for scan, pose in places[number].keyframes[self._keyframes[number] :]:
                self._map_model.integrate(scan, frame @ pose)
            self._keyframes[number] = len(places[number].keyframes)
        return self._map_model.cells.grid()
