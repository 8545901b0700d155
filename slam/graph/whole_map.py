"""The global map: all keyframes of all local maps at the poses of the graph."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from slam.geometry import Array, Pose2, between
from slam.graph.bulk import Bulk
from slam.graph.local_map import LocalMap
from slam.grid import OccupancyGrid
from slam.interface import MapModel

MAX_SHIFT, MAX_TURN = 0.01, math.radians(0.2)  # m, rad, of a local map before the map is redone


class WholeMap:
    """One map of any model: extended while the local maps keep their poses, else built anew.

    max_shift, max_turn  m, rad, by which a local map may move before the map is built anew
    poses                (n, 3) at which local maps were drawn
    """

    def __init__(
        self,
        map_model: Callable[[], MapModel],
        max_shift: float = MAX_SHIFT,
        max_turn: float = MAX_TURN,
    ):
        self._make, self._max_shift, self._max_turn = map_model, max_shift, max_turn
        self._begin()

    def _begin(self) -> None:
        self.map_model = self._make()
        self.poses = np.zeros((0, 3))
        self._keyframes: list[int] = []  # number of keyframes integrated of each

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles."""
        return self.map_model.cells.tiles.nbytes

    def forget(self, number: int) -> None:
        """Forget a local map: it is left out when the map is built anew."""
        if number < len(self.poses):
            self.poses = np.delete(self.poses, number, axis=0)
            del self._keyframes[number]

    def map(self, places: Sequence[LocalMap], poses: Array) -> OccupancyGrid:
        """A copy of the map of the local maps `places` at `poses` (n, 3)."""
        self.update(places, poses)
        return self.map_model.cells.grid()

    def update(self, places: Sequence[LocalMap], poses: Array) -> None:
        """Draw what is new."""
        deque(self.drawing(places, poses), maxlen=0)

    def drawing(self, places: Sequence[LocalMap], poses: Array) -> Iterator[np.ndarray]:
        """Draw what is new, local map by local map; yields the ids of the cells that may have
        changed by each."""
        moved = between(self.poses, poses[: len(self.poses)])
        if (np.hypot(moved[:, 0], moved[:, 1]) > self._max_shift).any() or (
            np.abs(moved[:, 2]) > self._max_turn
        ).any():
            self._begin()
        new = len(self.poses)
        self.poses = np.vstack([self.poses, poses[new : len(places)]])
        self._keyframes += [0] * (len(places) - new)
        for number in range(max(new - 1, 0), len(places)):
            frame, bulk = Pose2.of(self.poses[number]), Bulk(self.map_model)
            for scan, pose in places[number].keyframes[self._keyframes[number] :]:
                bare = scan.bare()  # its cached properties are freed with it
                bulk.integrate(bare, frame @ pose)
            self._keyframes[number] = len(places[number].keyframes)
            yield bulk.finish()
