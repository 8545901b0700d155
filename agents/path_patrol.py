"""PathPatrol: drives to and fro along a given path, for ever."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.pilot import Pilot
from dynslam_env.navigation.site import PatrolView
from slam.errors import InputError
from slam.geometry import Array


class PathPatrol:
    """Follows a path to its end, then back, by the SLAM's pose.

    The path is the layout's, so that it knows of the place what no other agent but the oracle does:
    it is what a person would script who has the floor plan. Where it does not get on, it turns
    back.

    site  the environment
    path  (p, 2) m, world
    seed  of the recoveries
    """

    def __init__(self, site: PatrolView, path: Array, seed: int = 0):
        self._path = np.asarray(path, dtype=np.float64)
        if self._path.ndim != 2 or self._path.shape[1:] != (2,) or not len(self._path):
            raise InputError(f"path has shape (p, 2), p >= 1, got {self._path.shape}")
        self._along = np.concatenate([[0.0], np.hypot(*np.diff(self._path, axis=0).T).cumsum()])
        self._pilot = Pilot(site, np.random.default_rng(seed))
        self._direction, self._begun_at = 1, 0.0
        self._follow()

    def predict(
        self,
        observation: Any = None,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """The next action (2,), in -1 .. 1; `state` is handed through."""
        return self._action(), state

    def _action(self) -> NDArray[np.float32]:
        if self._pilot.arrived and not self._pilot.recovering:
            self._turn_back()
        action = self._pilot.action()
        if self._pilot.stuck:
            self._turn_back()
        return action

    def _turn_back(self) -> None:
        """The other way along the path, from where it is."""
        at = self._begun_at + self._direction * self._pilot.follower.driven
        self._begun_at = min(max(at, 0.0), float(self._along[-1]))
        self._direction = -self._direction
        self._follow()

    def _follow(self) -> None:
        """Take the rest of the path in the present direction."""
        at = self._begun_at
        here = [[np.interp(at, self._along, axis) for axis in self._path.T]]
        rest = (
            self._path[self._along > at]
            if self._direction > 0
            else self._path[self._along < at][::-1]
        )
        self._pilot.follower.follow(np.concatenate([here, rest]), None, np.empty(0))
