"""The whole map: all keyframes of all local maps, where they are believed to lie."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from slam.geometry import Array, Pose2, between
from slam.graph.local_map import LocalMap
from slam.grid import OccupancyGrid
from slam.interface import MapModel

SHIFTED = 0.01  # m: a local map that moved less stays where it was drawn
TURNED = math.radians(0.2)


class WholeMap:
    """One map of any model, which is drawn on while the poses stay, and anew when they moved."""

    def __init__(self, map_model: Callable[[], MapModel]):
        self._make = map_model
        self._begin()

    def _begin(self) -> None:
        self._map_model = self._make()
        self._drawn = np.zeros((0, 3))  # the poses of local maps that are drawn
        self._keyframes: list[int] = []  # how many of each one's are

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles in use."""
        return self._map_model.cells.tiles.nbytes

    def map(self, places: Sequence[LocalMap], poses: Array) -> OccupancyGrid:
        """The map of the local maps at `poses` (n, 3), in the order of time; a copy."""
        moved = between(self._drawn, poses[: len(self._drawn)])
        if (np.hypot(moved[:, 0], moved[:, 1]) > SHIFTED).any() or (
            np.abs(moved[:, 2]) > TURNED
        ).any():
            self._begin()
        new = len(self._drawn)
        self._drawn = np.vstack([self._drawn, poses[new : len(places)]])
        self._keyframes += [0] * (len(places) - new)
        for number in range(max(new - 1, 0), len(places)):
            frame = Pose2.of(self._drawn[number])
            for scan, pose in places[number].keyframes[self._keyframes[number] :]:
                self._map_model.integrate(scan, frame @ pose)
            self._keyframes[number] = len(places[number].keyframes)
        return self._map_model.cells.grid()
