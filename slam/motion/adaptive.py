"""A motion model that learns the standard deviation of the odometry's heading."""

from __future__ import annotations

import math

from slam.geometry import Array, Pose2
from slam.motion.gaussian import GaussianMotion
from slam.validation import instance, positive_number

MIN_DISTANCE = 0.02  # m, at least, that an error of the heading is divided by to give a rate


class AdaptiveOdometry:
    """Follows the recent errors of the odometry's heading: one setting for good and bad wheels.

    A prior wide enough for the paper's odometry (3 degrees per 5 cm) allows any turn of a robot
    that scans every half metre; one narrow enough for that robot biases the heading of the other.
    So the heading's error per metre starts at the base's, and then follows the root mean square of
    the errors found by scan matching over the last metres. Displacements are not corrected: a bias
    remains (see `LearnedOdometry`), but within the deviations.

    base      the deviations at the start; all but `rotation_per_m` stay the same
    least     rad per m, lower limit of `rotation_per_m`
    width     deviation by root mean square of the errors
    memory    m of travel over which the mean is taken
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
        """The displacement unchanged."""
        return displacement

    def deviations(self, displacement: Pose2) -> Array:
        """(3,) standard deviations of x, y in m and theta in rad; the errors are independent."""
        deviations = self.base.deviations(displacement)
        deviations[2] = self.base.rotation(displacement, self._rotation_per_m)
        return deviations

    def learn(self, displacement: Pose2, found: Pose2, covariance: Array) -> None:
        """Update the rate: the odometry measured `displacement`, scan matching found `found`."""
        driven = math.hypot(displacement.x, displacement.y)
        if driven == 0.0:
            return
        error = math.remainder(found.theta - displacement.theta, math.tau)
        expected = math.hypot(
            self.base.rotation_per_rad * displacement.theta, self.base.rotation_floor
        )
        square = max(error**2 - expected**2, 0.0) / max(driven, MIN_DISTANCE) ** 2
        weight = min(driven / self.memory, 1.0)
        self.rate = math.sqrt((1.0 - weight) * self.rate**2 + weight * square)
        rate = max(self.width * self.rate, self.least)
        self._rotation_per_m = min(rate, self.base.rotation_per_m)
