"""WallFollower: follows the wall at its right or left, by the scan alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.follower import State
from dynslam_env.navigation.guard import free_length, guarded
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot, PatrolView
from dynslam_env.navigation.pilot import action
from dynslam_env.navigation.pursuit import Command
from dynslam_env.navigation.recovery import Recovery
from slam.geometry import Array
from slam.scan import Scan

WALL_DISTANCE = 0.5  # m, kept from the robot's centre to the wall
CRUISE_SPEED = 0.45  # m/s
AHEAD_ANGLE = math.radians(40)  # between the two ranges to the wall: abeam, and ahead of that
MAX_WALL_DISTANCE = 1.2  # m: a wall farther away has ended
DISTANCE_GAIN = 1.6  # rad/s per m of error in the distance
TILT_GAIN = 1.2  # rad/s per rad between the robot's heading and the wall
MIN_FREE_LENGTH = 0.45  # m, ahead; with less it turns away from the wall
TURN_RATE = 0.9  # rad/s
CORNER_RADIUS = 0.45  # m, of the arc around the end of a wall
CORNER_SPEED = 0.7  # share of CRUISE_SPEED on that arc
BEAM_TOLERANCE = math.radians(5)  # around the two ranges


class WallFollower:
    """Follows the wall at one side: along it, away from what is ahead, and around its ends.

    The rule leads out of any maze of connected walls. The SLAM's pose serves only to detect that
    the robot is stuck; no map is used.

    view  the environment
    seed  of the side and of the recoveries
    """

    def __init__(self, view: PatrolView, seed: int = 0):
        rng = np.random.default_rng(seed)
        self._view, self._recovery = view, Recovery(rng)
        self._side = 1.0 if rng.random() < 0.5 else -1.0  # 1: the wall is at the left

    def predict(
        self,
        observation: Any = None,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """The next action (2,), in -1 .. 1; `state` is returned unchanged."""
        snapshot = self._view.snapshot()
        return action(self._command(snapshot), snapshot.limits), state

    def _command(self, snapshot: PatrolSnapshot) -> Command:
        now, scan, robot = snapshot.time, snapshot.scan, snapshot.robot
        recovery = self._recovery.command(now)
        if recovery is not None:
            return recovery
        if self._recovery.stuck(now, snapshot.pose, State.TURNING):
            return self._recovery.begin(now)
        return guarded(self._along_wall(scan, robot.radius), scan, robot, snapshot.period)

    def _along_wall(self, scan: Scan, radius: float) -> Command:
        if free_length(scan, 0.0, radius + 0.05) < MIN_FREE_LENGTH:
            return Command(0.0, -self._side * TURN_RATE)
        distance, tilt = self._wall(scan)
        if distance > MAX_WALL_DISTANCE:
            v = CRUISE_SPEED * CORNER_SPEED
            return Command(v, self._side * v / CORNER_RADIUS)
        omega = self._side * (DISTANCE_GAIN * (distance - WALL_DISTANCE) - TILT_GAIN * tilt)
        return Command(CRUISE_SPEED, min(max(omega, -TURN_RATE), TURN_RATE))

    def _wall(self, scan: Scan) -> tuple[float, float]:
        """m to the wall at this side, and rad from the wall's direction to the robot's heading,
        negative towards the wall.

        From the range abeam and the one AHEAD_ANGLE ahead of it; inf, 0 without an echo abeam.
        """
        abeam, ahead = (
            _range(scan, self._side * math.pi / 2),
            _range(scan, self._side * (math.pi / 2 - AHEAD_ANGLE)),
        )
        if not math.isfinite(abeam):
            return math.inf, 0.0
        if not math.isfinite(ahead):
            return abeam, 0.0
        along, across = ahead * math.sin(AHEAD_ANGLE), ahead * math.cos(AHEAD_ANGLE)
        tilt = math.atan2(across - abeam, along)
        return abeam * math.cos(tilt), -tilt


def _range(scan: Scan, angle: float) -> float:
    """m, the nearest echo within BEAM_TOLERANCE of `angle`, rad, in the robot's frame; or inf."""
    offset = np.abs(scan.angles + scan.mount.theta - angle)
    ranges: Array = scan.ranges[(offset < BEAM_TOLERANCE) & scan.hit]
    return float(ranges.min(initial=math.inf))
