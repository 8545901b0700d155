"""Recovery: notices that the robot does not get on, backs it off and turns it."""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.navigation.follower import State
from dynslam_env.navigation.pursuit import Command
from slam.geometry import Pose2

PATIENCE = 4.0  # s without getting on
MOVED = 0.1  # m
TURNED = 0.35  # rad, so much or MOVED is getting on
BACK = Command(-0.15, 0.0)
BACK_FOR = 1.2  # s
TURN = 1.0  # rad/s
TURN_FOR = (0.8, 2.0)  # s, drawn from


class Recovery:
    """Back off a little, then turn by a random angle, as ROS's move_base does when all else fails.

    rng  draws side and length of the turns
    """

    def __init__(self, rng: np.random.Generator):
        self._rng = rng
        self._since, self._from = -math.inf, Pose2()
        self._back_until = self._until = -math.inf
        self._turn = Command(0.0, 0.0)

    def stuck(self, time: float, pose: Pose2, state: State) -> bool:
        """Whether the robot has not got on for PATIENCE: neither moved nor, where that is all that
        it wants, turned."""
        moved = math.hypot(pose.x - self._from.x, pose.y - self._from.y) > MOVED
        turned = abs(math.remainder(pose.theta - self._from.theta, math.tau)) > TURNED
        if state is State.TURNING:
            moved |= turned
        if state is State.STANDING or moved or self._since == -math.inf:
            self._since, self._from = time, pose
        return time - self._since > PATIENCE

    def begin(self, time: float) -> Command:
        """Recover from `time`, s, on; gives the first command."""
        side = 1.0 if self._rng.random() < 0.5 else -1.0
        self._turn = Command(0.0, side * TURN)
        self._back_until = time + BACK_FOR
        self._until = self._back_until + self._rng.uniform(*TURN_FOR)
        self._since = -math.inf
        return BACK

    def command(self, time: float) -> Command | None:
        """What the recovery does at `time`, s; None when there is none or it is over."""
        if time >= self._until:
            return None
        return BACK if time < self._back_until else self._turn
