"""Recovery: detects that the robot is stuck, backs it up and turns it."""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.navigation.follower import State
from dynslam_env.navigation.pursuit import Command
from slam.geometry import Pose2

STUCK_TIME = 4.0  # s without progress
PROGRESS_DISTANCE = 0.1  # m that count as progress ...
PROGRESS_ANGLE = 0.35  # rad, ... or, of a turn on the spot, these
BACK_UP = Command(-0.15, 0.0)
BACK_UP_TIME = 1.2  # s
RECOVERY_TURN_RATE = 1.0  # rad/s
RECOVERY_TURN_TIMES = (0.8, 2.0)  # s, uniformly drawn


class Recovery:
    """Back up, then turn by a random angle: the last resort of ROS's move_base.

    rng  draws side and duration of the turns
    """

    def __init__(self, rng: np.random.Generator):
        self._rng = rng
        self._since, self._from = -math.inf, Pose2()  # time and pose of the last progress
        self._back_until = self._until = -math.inf
        self._turn = Command(0.0, 0.0)

    def stuck(self, time: float, pose: Pose2, state: State) -> bool:
        """Whether the robot made no progress for STUCK_TIME: it neither moved nor, where it wants
        to turn only, turned."""
        moved = math.hypot(pose.x - self._from.x, pose.y - self._from.y) > PROGRESS_DISTANCE
        turned = abs(math.remainder(pose.theta - self._from.theta, math.tau)) > PROGRESS_ANGLE
        if state is State.TURNING:
            moved |= turned
        if state is State.STANDING or moved or self._since == -math.inf:
            self._since, self._from = time, pose
        return time - self._since > STUCK_TIME

    def begin(self, time: float) -> Command:
        """Begin a recovery at `time`, s; returns its first command."""
        side = 1.0 if self._rng.random() < 0.5 else -1.0
        self._turn = Command(0.0, side * RECOVERY_TURN_RATE)
        self._back_until = time + BACK_UP_TIME
        self._until = self._back_until + self._rng.uniform(*RECOVERY_TURN_TIMES)
        self._since = -math.inf
        return BACK_UP

    def command(self, time: float) -> Command | None:
        """The recovery's command at `time`, s; None if none is under way."""
        if time >= self._until:
            return None
        return BACK_UP if time < self._back_until else self._turn
