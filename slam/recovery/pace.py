"""Jumps of the odometry: motions by accelerations that wheels do not have."""

from __future__ import annotations

import math
from typing import NamedTuple

from slam.episode import Episode
from slam.geometry import Pose2

FARTHER, ACCELERATION = 0.3, 1.5  # m, m/s^2: so much more than at the velocity before is a jump
MORE_TURN, TURNING = math.radians(30.0), 3.0  # rad, rad/s^2: likewise
AVERAGED = 0.4  # s over which the velocity is a mean, at least: in some logs scans come in bursts


class Pace:
    """The velocity of the robot by its odometry.

    Two motions in a row at the same velocity are none, whatever it was before.

    expected  if the odometry jumped before the last scan, the motion at the velocity before;
              otherwise None. After a reset the odometry tells of no motion; but as often it
              catches up, because it was late, or because scans are missing
    """

    def __init__(self) -> None:
        self.expected: Pose2 | None = None
        self._time = math.inf  # s, of the last scan
        self._velocity = Pose2()  # m/s, m/s, rad/s
        self._odd: Pose2 | None = None  # velocity of the last motion, if that was a jump
        self._motion, self._elapsed = Pose2(), 0.0  # m, m, rad; s: since it was computed

    def move(self, displacement: Pose2, time: float) -> None:
        """Add the motion to a scan at `time`, s, by the odometry."""
        before, self._time = self._time, time
        if math.isinf(before):
            return
        seconds = max(time - before, 0.0)
        velocity, odd, self._odd, self.expected = self._velocity, self._odd, None, None
        if _jumps(displacement, velocity, seconds):
            if odd is None or _jumps(displacement, odd, seconds):
                self.expected = _scaled(velocity, seconds)
                self._odd = _scaled(displacement, 1.0 / seconds) if seconds > 0.0 else None
                return
            self._velocity, self._motion, self._elapsed = odd, Pose2(), 0.0  # two motions agree
        (x, y, theta), self._elapsed = self._motion, self._elapsed + seconds
        self._motion = Pose2(x + displacement.x, y + displacement.y, theta + displacement.theta)
        if self._elapsed > AVERAGED:
            self._velocity = _scaled(self._motion, 1.0 / self._elapsed)
            self._motion, self._elapsed = Pose2(), 0.0


def _jumps(displacement: Pose2, velocity: Pose2, seconds: float) -> bool:
    """Whether wheels cannot accelerate so much since they had a velocity."""
    expected, square = _scaled(velocity, seconds), seconds * seconds
    far = math.hypot(displacement.x - expected.x, displacement.y - expected.y)
    turn = abs(displacement.theta - expected.theta)
    return far > max(FARTHER, ACCELERATION * square) or turn > max(MORE_TURN, TURNING * square)


class Jump(NamedTuple):
    """A motion that no robot makes.

    time      s, of the scan after it
    distance  m, by which it differs from a motion at the velocity before
    turn      rad, likewise
    """

    time: float
    distance: float
    turn: float


def jumps(episode: Episode) -> list[Jump]:
    """Where the odometry of a recording jumps; or where scans are missing, between which the robot
    changed its velocity."""
    pace, found = Pace(), []
    for motion, scan in zip(episode.displacements(), episode.scans, strict=True):
        pace.move(motion, scan.time)
        if pace.expected is not None:
            off = pace.expected.between(motion)
            found.append(Jump(scan.time, math.hypot(off.x, off.y), off.theta))
    return found


def _scaled(motion: Pose2, factor: float) -> Pose2:
    return Pose2(motion.x * factor, motion.y * factor, motion.theta * factor)
