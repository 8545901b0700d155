"""WallFollower: keeps a wall at its right or left hand, from the scan alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.follower import State
from dynslam_env.navigation.guard import free_length, guarded
from dynslam_env.navigation.pilot import action
from dynslam_env.navigation.pursuit import Command
from dynslam_env.navigation.recovery import Recovery
from dynslam_env.navigation.site import PatrolView
from slam.geometry import Array
from slam.scan import Scan

DISTANCE = 0.5  # m, that the wall is kept at, from the robot's centre
CRUISE = 0.45  # m/s
AHEAD = math.radians(40)  # how far ahead of abeam the wall is looked for
LOST = 1.2  # m: a wall farther away has ended
GAIN = 1.6  # rad/s a metre that the wall is too near or too far
DAMPING = 1.2  # rad/s a rad that the robot heads off the wall's direction
TURN_AT = 0.45  # m, of free way: with less it turns away from the wall
TURN = 0.9  # rad/s
SWING = 0.45  # m, radius of the arc around a wall's end


class WallFollower:
    """Follows the wall at one hand: along it, away from what is ahead, and around its ends.

    The rule that leads out of any maze whose walls hang together. It uses no map and no pose but to
    notice that it is stuck.

    site  the environment; of it the scan is used
    seed  decides the hand, and the recoveries
    """

    def __init__(self, site: PatrolView, seed: int = 0):
        rng = np.random.default_rng(seed)
        self._site, self._recovery = site, Recovery(rng)
        self._side = 1.0 if rng.random() < 0.5 else -1.0  # 1: the wall is at the left

    def predict(
        self,
        observation: Any = None,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """The next action (2,), in -1 .. 1; `state` is handed through."""
        return action(self._command(), self._site), state

    def _command(self) -> Command:
        site = self._site
        recovering = self._recovery.command(site.time)
        if recovering is not None:
            return recovering
        if self._recovery.stuck(site.time, site.slam.pose, State.TURNING):
            return self._recovery.begin(site.time)
        return guarded(self._along_wall(site.scan), site.scan, site.robot, site.period)

    def _along_wall(self, scan: Scan) -> Command:
        if free_length(scan, 0.0, self._site.robot.radius + 0.05) < TURN_AT:
            return Command(0.0, -self._side * TURN)
        distance, tilt = self._wall(scan)
        if distance > LOST:
            return Command(CRUISE * 0.7, self._side * CRUISE * 0.7 / SWING)
        omega = self._side * (GAIN * (distance - DISTANCE) - DAMPING * tilt)
        return Command(CRUISE, min(max(omega, -TURN), TURN))

    def _wall(self, scan: Scan) -> tuple[float, float]:
        """m to the wall at this hand, and rad by which the robot heads towards it if negative.

        From the ranges abeam and AHEAD before it: inf, 0 where abeam there is nothing.
        """
        abeam, ahead = (
            _range(scan, self._side * math.pi / 2),
            _range(scan, self._side * (math.pi / 2 - AHEAD)),
        )
        if not math.isfinite(abeam):
            return math.inf, 0.0
        if not math.isfinite(ahead):
            return abeam, 0.0
        tilt = math.atan2(ahead * math.cos(AHEAD) - abeam, ahead * math.sin(AHEAD))
        return abeam * math.cos(tilt), -tilt


def _range(scan: Scan, angle: float) -> float:
    """m, the nearest echo within 5 degrees of `angle`, rad, of the robot; inf for none."""
    off = np.abs(scan.angles + scan.mount.theta - angle)
    ranges: Array = scan.ranges[(off < math.radians(5)) & scan.hit]
    return float(ranges.min(initial=math.inf))
