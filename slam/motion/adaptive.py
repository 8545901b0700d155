"""A motion model that learns how far the odometry's heading is off: the width, not the error."""

from __future__ import annotations

import math

from slam.geometry import Array, Pose2
from slam.motion.gaussian import GaussianMotion
from slam.validation import instance, positive_number

SHORT = 0.02  # m: over less way, an error of the heading says nothing of a rate


class AdaptiveOdometry:
    """As wide as the odometry's heading has been off lately: one setting for good wheels and bad.

    A prior wide enough for the paper's odometry (3 degrees per 5 cm) believes any turn of a robot
    that scans each half metre; one narrow enough for that robot drags the other's heading. So the
    rate of the heading's error per metre begins at the base's, and then follows the mean square of
    what the matches found, over the last metres. No displacement is corrected: a bias stays one
    (see `LearnedOdometry`), it only is no surprise.

    base      the deviations at the start; all but `rotation_per_m` stay
    least     rad per m, which the rate does not fall below
    width     the deviation is so many times the root mean square of the errors
    memory    m of way over which the mean is taken
    rate      rad per m: root mean square of the error, as learned so far
    """

    def __init__(
        self,
        base: GaussianMotion = GaussianMotion(),
        least: float = math.radians(8.0),
        width: float = 2.0,
        memory: float = 2.0,
    ):
        instance("AdaptiveOdometry.base", base, GaussianMotion)
        for name, value in (("least", least), ("width", width), ("memory", memory)):
            positive_number(f"AdaptiveOdometry.{name}", value)
        self.base = base
        self.least = least
        self.width = width
        self.memory = memory
        self.rate = base.rotation_per_m / width
        self._rotation_per_m = base.rotation_per_m

    def corrected(self, displacement: Pose2) -> Pose2:
        """The odometry as it is."""
        return displacement

    def deviations(self, displacement: Pose2) -> Array:
        """(3,) standard deviations of x, y in m and theta in rad; the errors are independent."""
        deviations = self.base.deviations(displacement)
        deviations[2] = self.base.rotation(displacement, self._rotation_per_m)
        return deviations

    def learn(self, displacement: Pose2, found: Pose2, covariance: Array) -> None:
        """The odometry said `displacement`, and a scan then found `found`."""
        driven = math.hypot(displacement.x, displacement.y)
        if driven == 0.0:
            return
        error = math.remainder(found.theta - displacement.theta, math.tau)
        expected = math.hypot(
            self.base.rotation_per_rad * displacement.theta, self.base.rotation_floor
        )
        square = max(error**2 - expected**2, 0.0) / max(driven, SHORT) ** 2
        weight = min(driven / self.memory, 1.0)
        self.rate = math.sqrt((1.0 - weight) * self.rate**2 + weight * square)
        rate = max(self.width * self.rate, self.least)
        self._rotation_per_m = min(rate, self.base.rotation_per_m)
