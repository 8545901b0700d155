"""The global map: all keyframes of all local maps at the poses of the graph."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from slam.geometry import Array, Pose2, between
from slam.graph.local_map import LocalMap
from slam.grid import OccupancyGrid
from slam.interface import MapModel
from slam.maps.static import Static
from slam.motion.threshold import MotionThreshold, MotionTrigger
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

MAX_SHIFT, MAX_TURN = 0.01, math.radians(0.2)  # m, rad, of a local map before the map is redone
SEARCHED_SHIFT, SEARCHED_TURN = 0.1, math.radians(1.0)  # the same, of a map that is searched
EVERY = MotionThreshold(distance=0.0, turn=0.0, time=0.0)  # between keyframes that are drawn
SEARCHED_EVERY = MotionThreshold(distance=0.5, turn=math.radians(45.0), time=math.inf)
NO_CELLS = np.empty(0, dtype=np.int64)  # cell ids


class WholeMap:
    """One map of any model: extended while the local maps keep their poses, else built anew.

    max_shift, max_turn  m, rad, by which a local map may move before the map is built anew
    every                spacing of the keyframes that are drawn
    """

    def __init__(
        self,
        map_model: Callable[[], MapModel],
        max_shift: float = MAX_SHIFT,
        max_turn: float = MAX_TURN,
        every: MotionThreshold = EVERY,
    ):
        self._make, self._max_shift, self._max_turn = map_model, max_shift, max_turn
        self._every = every
        self._begin()

    def _begin(self) -> None:
        self.map_model = self._make()
        self._poses = np.zeros((0, 3))  # at which local maps were integrated
        self._keyframes: list[int] = []  # number of keyframes of each that were considered
        self._since_drawn = MotionTrigger(self._every)

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles."""
        return self.map_model.cells.tiles.nbytes

    def map(self, places: Sequence[LocalMap], poses: Array) -> OccupancyGrid:
        """A copy of the map of the local maps `places` at `poses` (n, 3)."""
        self.update(places, poses)
        return self.map_model.cells.grid()

    def update(self, places: Sequence[LocalMap], poses: Array) -> np.ndarray:
        """Draw what is new; returns the ids of the cells that may have changed."""
        moved = between(self._poses, poses[: len(self._poses)])
        if (np.hypot(moved[:, 0], moved[:, 1]) > self._max_shift).any() or (
            np.abs(moved[:, 2]) > self._max_turn
        ).any():
            self._begin()
        new = len(self._poses)
        self._poses = np.vstack([self._poses, poses[new : len(places)]])
        self._keyframes += [0] * (len(places) - new)
        changed = [NO_CELLS]
        for number in range(max(new - 1, 0), len(places)):
            frame = Pose2.of(self._poses[number])
            for scan, pose in places[number].keyframes[self._keyframes[number] :]:
                changed.append(self._drawn(scan, frame @ pose))
            self._keyframes[number] = len(places[number].keyframes)
        return np.concatenate(changed)

    def _drawn(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Draw the keyframe, if it is far enough from the one drawn before; the changed cells."""
        self._since_drawn.move_to(pose)
        if not self._since_drawn.due(scan.time):
            return NO_CELLS
        self._since_drawn.restart(scan.time, pose)
        return self.map_model.integrate(scan, pose)


class SearchedMap:
    """The whole map as the likelihood field in which a lost robot is searched for.

    It is made of fewer keyframes than the map: each wall is seen from many of them.
    """

    def __init__(self) -> None:
        self._whole = WholeMap(Static, SEARCHED_SHIFT, SEARCHED_TURN, SEARCHED_EVERY)
        self._endpoint = Endpoint()

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles."""
        return self._whole.nbytes

    def endpoint(self, places: Sequence[LocalMap], poses: Array) -> Endpoint:
        """The field of the local maps `places` at `poses` (n, 3), valid until the next call."""
        changed = self._whole.update(places, poses)
        self._endpoint.refresh(self._whole.map_model, changed)
        return self._endpoint
