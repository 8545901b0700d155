"""PathPatrol: drives back and forth along a given path."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot, PatrolView
from dynslam_env.navigation.pilot import Pilot
from slam.errors import InputError
from slam.geometry import Array


class PathPatrol:
    """Follows a path to its end, then back, by the SLAM's pose. If it is stuck, it turns back.

    The path is the layout's: apart from the oracle, no other agent is given any of the truth. It
    stands for a script written from the floor plan.

    view  the environment
    path  (p, 2) m, world
    seed  of the recoveries
    """

    def __init__(self, view: PatrolView, path: Array, seed: int = 0):
        self._view, self._path = view, np.asarray(path, dtype=np.float64)
        if self._path.ndim != 2 or self._path.shape[1:] != (2,) or not len(self._path):
            raise InputError(f"path has shape (p, 2), p >= 1, got {self._path.shape}")
        steps = np.hypot(*np.diff(self._path, axis=0).T)
        self._distances = np.concatenate([[0.0], steps.cumsum()])
        self._pilot = Pilot(np.random.default_rng(seed))
        self._direction, self._start = 1, 0.0  # m along the path, where this direction began
        self._follow()

    def predict(
        self,
        observation: Any = None,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """The next action (2,), in -1 .. 1; `state` is returned unchanged."""
        return self._action(self._view.snapshot()), state

    def _action(self, snapshot: PatrolSnapshot) -> NDArray[np.float32]:
        pilot = self._pilot
        if pilot.arrived(snapshot) and not pilot.recovering(snapshot):
            self._turn_back()
        action = pilot.action(snapshot)
        if pilot.stuck:
            self._turn_back()
        return action

    def _turn_back(self) -> None:
        """Reverse the direction, from the present point of the path."""
        at = self._start + self._direction * self._pilot.follower.travelled
        self._start = min(max(at, 0.0), float(self._distances[-1]))
        self._direction = -self._direction
        self._follow()

    def _follow(self) -> None:
        """Follow the rest of the path in the present direction."""
        start, path = self._start, self._path
        here = [[np.interp(start, self._distances, axis) for axis in path.T]]
        ahead, behind = path[self._distances > start], path[self._distances < start][::-1]
        rest = ahead if self._direction > 0 else behind
        self._pilot.follower.follow(np.concatenate([here, rest]), None, np.empty(0))
