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
from dynslam_env.reset_options import reset_arguments
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2

LOOKAHEAD_DISTANCE = 0.5  # m, along the path, to the point that is steered to
WAYPOINT_TOLERANCE = 0.1  # m
JUMP_DISTANCE = 1.0  # m, from one prediction to the next: the robot was carried elsewhere


class ScriptedPath:
    """Pure pursuit (Coulter 1992) along a polyline, segment by segment; stands still at its end.

    It uses no observation: the drive is the same in all worlds where nothing touches the robot.
    A robot that was carried elsewhere goes on along the segment nearest to it.

    waypoints  (p, 2) m, world
    pose       returns the true pose
    robot      its limits; actions are normalised by them (default: Pioneer 3-DX)
    speed      m/s
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
        self._before: Pose2 | None = None

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
        """The next action (2,), in -1 .. 1; `state` is returned unchanged."""
        pose, before = self._pose(), self._before
        if before is not None and math.dist(pose[:2], before[:2]) > JUMP_DISTANCE:
            self._rejoin(pose)
        self._before = pose
        v, omega = self._command(pose)
        action = v / self._robot.max_speed, omega / self._robot.max_turn
        return np.array(action, dtype=np.float32), state

    def _command(self, pose: Pose2) -> tuple[float, float]:
        while not self.finished and self._at_waypoint(pose):
            self._next += 1
        if self.finished:
            return 0.0, 0.0
        v = min(self._speed, math.sqrt(1.5 * self._robot.acceleration * self._distance(pose)))
        return arc_to(pose, self._lookahead_point(pose), v, LOOKAHEAD_DISTANCE)

    def _rejoin(self, pose: Pose2) -> None:
        """Go on along the nearest segment; of equally near ones, the present or the first one."""
        starts, ends = self._waypoints[:-1], self._waypoints[1:]
        legs = ends - starts
        squares = np.maximum((legs**2).sum(axis=1), 1e-12)
        shares = np.clip(((pose[:2] - starts) * legs).sum(axis=1) / squares, 0.0, 1.0)
        away = np.hypot(*(starts + shares[:, None] * legs - pose[:2]).T)
        current = self._next - 1
        near = away < away.min(initial=math.inf) + WAYPOINT_TOLERANCE
        if near.any() and not (0 <= current < len(away) and near[current]):
            self._next = int(near.argmax()) + 1

    def _at_waypoint(self, pose: Pose2) -> bool:
        """Within WAYPOINT_TOLERANCE of the next waypoint, or near it and past the segment's end."""
        distance = self._distance(pose)
        if distance >= LOOKAHEAD_DISTANCE or distance < WAYPOINT_TOLERANCE:
            return distance < WAYPOINT_TOLERANCE
        start, segment, length = self._segment()
        return length > 0.0 and float((pose[:2] - start) @ segment) > length**2

    def _segment(self) -> tuple[Array, Array, float]:
        """Start of the present segment, vector to its end, and length, m."""
        start = self._waypoints[max(self._next - 1, 0)]
        segment = self._waypoints[self._next] - start
        return start, segment, float(np.hypot(*segment))

    def _distance(self, pose: Pose2) -> float:
        x, y = self._waypoints[self._next]
        return math.hypot(x - pose.x, y - pose.y)

    def _lookahead_point(self, pose: Pose2) -> tuple[float, float]:
        """The point of the segment LOOKAHEAD_DISTANCE beyond the foot of the perpendicular."""
        start, segment, length = self._segment()
        if length == 0.0:
            return start[0], start[1]
        along = float((np.array([pose.x, pose.y]) - start) @ segment) / length
        x, y = start + segment * ((along + LOOKAHEAD_DISTANCE) / length)
        return x, y


def record_path(
    env_id: str,
    seed: int,
    doors: str | Doors | None = None,
    speed: float = 0.55,
    split: str | None = None,
    **parameters: Any,
) -> Episode:
    """One drive along the path of the world `env_id`, such as DoorLoop-v0, recorded.

    seed        of the episode; with a split, its index there
    doors       default: the world's own
    split       "train", "validation" or "test"
    parameters  of the environment, `max_episode_steps` among them

    With the same seed, `doors="static"` and `doors="moving"` give a pair that differs only in the
    doors: place, drive and noise are the same.
    """
    given = parameters if doors is None else {"doors": doors, **parameters}
    env = gym.make(f"dynslam_env:{env_id}", **given)
    env.reset(**reset_arguments(seed, split))  # to read the path; `record` begins it again
    place = env.unwrapped
    assert isinstance(place, DoorWorldEnv)
    driver = ScriptedPath(place.layout.path, lambda: place.pose, place.robot, speed)
    return record(env, driver, seed, split)


def record_corridor(
    seed: int, doors: str | Doors = "moving", speed: float = 0.55, **parameters: Any
) -> Episode:
    """One drive along the passage and back in DoorCorridor-v0; see `record_path`."""
    return record_path("DoorCorridor-v0", seed, doors, speed, **parameters)
