"""Jumps of the odometry: motions by accelerations that wheels do not have."""

from __future__ import annotations

import math

from slam.geometry import Pose2

BEYOND = 0.3, math.radians(30.0)  # m, rad: farther than at the velocity before, at least,
ACCELERATION = 1.5, 3.0  # m/s^2, rad/s^2: and by such an acceleration
AVERAGED = 0.4  # s over which the velocity is a mean, at least: in some logs scans come in bursts


class Pace:
    """The velocity of the robot by its odometry.

    expected  if the odometry jumped before the last scan, the motion at the velocity before;
              otherwise None. After a reset the odometry tells of no motion; but as often it
              catches up, because it was late, or because scans are missing
    """

    def __init__(self) -> None:
        self.expected: Pose2 | None = None
        self._time = math.inf  # s, of the last scan
        self._velocity = 0.0, 0.0, 0.0  # m/s, m/s, rad/s
        self._motion, self._elapsed = (0.0, 0.0, 0.0), 0.0  # since it was computed

    def move(self, displacement: Pose2, time: float) -> None:
        """Add the motion to a scan at `time`, s, by the odometry."""
        seconds, self._time = max(time - self._time, 0.0), time
        expected = Pose2(*(v * seconds for v in self._velocity))
        x, y, turn = (a - b for a, b in zip(displacement, expected, strict=True))
        limits = zip((math.hypot(x, y), abs(turn)), BEYOND, ACCELERATION, strict=True)
        jumped = any(far > max(least, most * seconds**2) for far, least, most in limits)
        self.expected = expected if jumped else None
        if jumped:
            return
        self._elapsed += seconds
        x, y, turn = (a + b for a, b in zip(self._motion, displacement, strict=True))
        self._motion = x, y, turn
        if self._elapsed > AVERAGED:
            self._velocity = x / self._elapsed, y / self._elapsed, turn / self._elapsed
            self._motion, self._elapsed = (0.0, 0.0, 0.0), 0.0
