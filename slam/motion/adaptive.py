"""A motion model that learns how large the errors of the odometry are."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Array, Pose2
from slam.motion.gaussian import GaussianMotion
from slam.motion.long_errors import LONG, LongErrors
from slam.motion.measured import measured
from slam.motion.systematic import BIAS_REST, Systematic
from slam.validation import instance, positive_number

MIN_DISTANCE = 0.02  # m, at least, that an error of the heading is divided by to give a rate
MIN_VARIANCE = 1e-9  # m^2, of a distance


class AdaptiveOdometry:
    """Follows the recent errors of the odometry: one setting for good and bad wheels.

    A prior wide enough for the paper's odometry (3 degrees per 5 cm) allows any turn of a robot
    that scans every half metre; one narrow enough for that robot biases the heading of the other.
    So the heading's error per metre starts at the base's, and then follows the root mean square of
    the errors found by scan matching over the last metres. The heading is corrected only once a
    bias is certain that is larger than these deviations can follow, and distances once it is
    certain that they are wrong by a tenth (`Systematic`); `LearnedOdometry` corrects any bias.

    base        the deviations at the start; all but `rotation_per_m` stay the same
    least       rad per m, lower limit of `rotation_per_m`
    width       deviation by root mean square of the errors
    memory      m of travel over which the mean is taken
    rate        rad per m: root mean square of the error, as learned so far
    systematic  errors, as learned so far
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
        self.systematic = Systematic()
        self._long = LongErrors()

    def corrected(self, displacement: Pose2) -> Pose2:
        """The displacement, longer or shorter if the odometry's distances are wrong, and turned if
        its heading is."""
        factor, turned = self.systematic.scale.factor, self._turned(displacement)
        return Pose2(factor * turned.x, factor * turned.y, turned.theta)

    def _turned(self, displacement: Pose2) -> Pose2:
        """The displacement without the bias, half of which is assumed to turn the translation."""
        bias = self.systematic.bias.correction
        if bias == 0.0:
            return displacement
        half = Pose2(0.0, 0.0, 0.5 * bias * math.hypot(displacement.x, displacement.y))
        return half @ displacement @ half

    def deviations(self, displacement: Pose2) -> Array:
        """(3,) standard deviations of x, y in m and theta in rad; the errors are independent."""
        driven = math.hypot(displacement.x, displacement.y)
        if driven < LONG:
            return self._short(displacement)
        share = math.sqrt(LONG / driven)
        short = self._short(
            Pose2(share * displacement.x, share * displacement.y, displacement.theta)
        )
        turn = self.base.deviations(Pose2(0.0, 0.0, displacement.theta))
        return np.minimum(short, np.hypot(self._long.deviations(driven), turn))

    def _short(self, displacement: Pose2) -> Array:
        """The deviations by the errors of keyframes."""
        return self.base.with_rotation(displacement, self._rotation_per_m)

    def learn(self, displacement: Pose2, found: Pose2, covariance: Array) -> None:
        """Update rate and scale: the odometry measured `displacement`, scan matching found `found`,
        with a covariance (3, 3) that combines prediction and scan."""
        driven = math.hypot(displacement.x, displacement.y)
        if driven == 0.0:
            return
        corrected = self.corrected(displacement)
        error = math.remainder(found.theta - corrected.theta, math.tau)
        before = [deviation**2 for deviation in self.deviations(displacement).tolist()]
        self._long.learn(corrected, found)
        self._learn_scale(displacement, driven, found, covariance, before[0])
        rest = self.base.rotation(displacement, BIAS_REST) ** 2
        self.systematic.bias.learn(driven, error, float(covariance[2, 2]), before[2], rest)
        expected = math.hypot(
            self.base.rotation_per_rad * displacement.theta, self.base.rotation_floor
        )
        square = max(error**2 - expected**2, 0.0) / max(driven, MIN_DISTANCE) ** 2
        weight = min(driven / self.memory, 1.0)
        self.rate = math.sqrt((1.0 - weight) * self.rate**2 + weight * square)
        rate = max(self.width * self.rate, self.least)
        self._rotation_per_m = min(rate, self.base.rotation_per_m)

    def _learn_scale(
        self, displacement: Pose2, driven: float, found: Pose2, covariance: Array, before: float
    ) -> None:
        """Update the scale by the distance in the direction of the displacement. The prediction, of
        variance `before`, is taken out of the covariance; where the scan has no information,
        nothing is learned."""
        if driven < MIN_DISTANCE:
            return
        turned, (xx, xy), (_, yy) = self._turned(displacement), *covariance[:2, :2].tolist()
        x, y = turned.x / driven, turned.y / driven  # the direction
        variance = max(x * x * xx + 2.0 * x * y * xy + y * y * yy, MIN_VARIANCE)
        predicted = self.systematic.scale.factor * driven
        scan = measured(x * found.x + y * found.y - predicted, variance, before)
        if scan is not None:
            self.systematic.scale.learn(driven, predicted + scan[0], scan[1] + before)
