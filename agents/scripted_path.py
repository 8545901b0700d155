"""ScriptedPath: drives along waypoints by the true pose, for paired experiments."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from dynslam_env import Doors, DoorWorldEnv, Robot, record
from dynslam_env.navigation.pursuit import arc_to
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2

LOOKAHEAD = 0.5  # m, distance of the point on the path that is steered to
REACH = 0.1  # m, so near a waypoint counts as there


class ScriptedPath:
    """Pure pursuit (Coulter 1992) along a polyline, leg by leg; stands still at its end.

    It looks at no observation: two worlds in which nothing touches the robot see the same drive.

    waypoints  (p, 2) m, world
    pose       gives the true pose
    robot      its limits; actions are normalised by them (default: Pioneer 3-DX)
    speed      m/s, on the way
    """

    def __init__(
        self,
        waypoints: Array,
        pose: Callable[[], Pose2],
        robot: Robot | None = None,
        speed: float = 0.55,
    ):
        self._waypoints = np.asarray(waypoints, dtype=np.float64)
        if self._waypoints.ndim != 2 or self._waypoints.shape[1:] != (2,):
            raise InputError(f"waypoints have shape (p, 2), got {self._waypoints.shape}")
        self._pose, self._robot, self._speed = pose, robot or Robot(), speed
        self._next = 0

    @property
    def finished(self) -> bool:
        """All waypoints were reached."""
        return self._next >= len(self._waypoints)

    def predict(
        self,
        observation: Any = None,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """The next action (2,), in -1 .. 1; `state` is handed through."""
        v, omega = self._command(self._pose())
        action = v / self._robot.max_speed, omega / self._robot.max_turn
        return np.array(action, dtype=np.float32), state

    def _command(self, pose: Pose2) -> tuple[float, float]:
        while not self.finished and self._there(pose):
            self._next += 1
        if self.finished:
            return 0.0, 0.0
        v = min(self._speed, math.sqrt(1.5 * self._robot.acceleration * self._away(pose)))
        return arc_to(pose, self._carrot(pose), v, LOOKAHEAD)

    def _there(self, pose: Pose2) -> bool:
        """Within REACH of the next waypoint, or just past the end of the leg that leads to it."""
        away = self._away(pose)
        if away >= LOOKAHEAD or away < REACH:
            return away < REACH
        start, leg, length = self._leg()
        return length > 0.0 and float((pose[:2] - start) @ leg) > length**2

    def _leg(self) -> tuple[Array, Array, float]:
        """Where the present leg begins, the way to its end, and its length, m."""
        start = self._waypoints[max(self._next - 1, 0)]
        leg = self._waypoints[self._next] - start
        return start, leg, float(np.hypot(*leg))

    def _away(self, pose: Pose2) -> float:
        x, y = self._waypoints[self._next]
        return math.hypot(x - pose.x, y - pose.y)

    def _carrot(self, pose: Pose2) -> tuple[float, float]:
        """The point of the present leg LOOKAHEAD m beyond the foot of the perpendicular."""
        start, leg, length = self._leg()
        if length == 0.0:
            return start[0], start[1]
        along = float((np.array([pose.x, pose.y]) - start) @ leg) / length
        x, y = start + leg * ((along + LOOKAHEAD) / length)
        return x, y


def record_path(
    env_id: str, seed: int, doors: str | Doors | None = None, speed: float = 0.55, **parameters: Any
) -> Episode:
    """One drive along the path of the world `env_id`, such as DoorLoop-v0, recorded.

    `doors` are the world's own where none are given; `parameters` are the environment's,
    `max_episode_steps` among them. With the same seed, `doors="static"` and `doors="moving"` give a
    pair: the same place, drive, and noise; the doors alone differ.
    """
    given = parameters if doors is None else {"doors": doors, **parameters}
    env = gym.make(f"dynslam_env:{env_id}", **given)
    env.reset(seed=seed)  # to learn the path; `record` begins this very episode again
    place = env.unwrapped
    assert isinstance(place, DoorWorldEnv)
    driver = ScriptedPath(place.layout.path, lambda: place.pose, place.robot, speed)
    return record(env, driver, seed)


def record_corridor(
    seed: int, doors: str | Doors = "moving", speed: float = 0.55, **parameters: Any
) -> Episode:
    """One drive along the passage and back in DoorCorridor-v0; see `record_path`."""
    return record_path("DoorCorridor-v0", seed, doors, speed, **parameters)
