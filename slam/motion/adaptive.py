"""A motion model that learns how large the errors of the odometry are."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Array, Pose2
from slam.motion.gaussian import GaussianMotion
from slam.motion.long_errors import LONG, LongErrors
from slam.validation import instance, positive_number

MIN_DISTANCE = 0.02  # m, at least, that an error of the heading is divided by to give a rate
SCALE_DEVIATION = 0.1  # of the distances that the odometry reports, before anything is learned
SCALE_DRIFT = 0.005  # random walk of their error within a metre
MIN_SCALE_ERROR = 0.1  # smaller errors are not corrected
SIGNIFICANT = 3.0  # standard deviations; less certain ones neither
MAX_SCALE_ERROR = 0.5  # of a single displacement; larger ones are slips
MIN_VARIANCE = 1e-9  # m^2, of a distance
MIN_INFORMATION_SHARE = 0.1  # of the prediction, that a scan adds about a distance to learn from


class DistanceScale:
    """A Kalman filter of the relative error of the odometry's distances: wrong wheel diameters.

    error      of the distances, as learned so far: true = (1 + error) reported
    variance   of it
    """

    def __init__(self) -> None:
        self.error, self.variance = 0.0, SCALE_DEVIATION**2

    @property
    def factor(self) -> float:
        """Of the distances; 1 as long as no large error is certain."""
        least = max(MIN_SCALE_ERROR, SIGNIFICANT * math.sqrt(self.variance))
        return 1.0 + self.error if abs(self.error) > least else 1.0

    def learn(self, reported: float, measured: float, variance: float) -> None:
        """Update by a reported distance that was measured, m, with a variance, m^2."""
        self.variance += SCALE_DRIFT**2 * reported
        error = measured / reported - 1.0
        if abs(error) > MAX_SCALE_ERROR:
            return
        gain = self.variance / (self.variance + variance / reported**2)
        self.error += gain * (error - self.error)
        self.variance *= 1.0 - gain


class AdaptiveOdometry:
    """Follows the recent errors of the odometry: one setting for good and bad wheels.

    A prior wide enough for the paper's odometry (3 degrees per 5 cm) allows any turn of a robot
    that scans every half metre; one narrow enough for that robot biases the heading of the other.
    So the heading's error per metre starts at the base's, and then follows the root mean square of
    the errors found by scan matching over the last metres. The heading is not corrected: a bias
    remains (see `LearnedOdometry`), but within the deviations. Distances are, once it is certain
    that they are wrong by more than MIN_SCALE_ERROR.

    base      the deviations at the start; all but `rotation_per_m` stay the same
    least     rad per m, lower limit of `rotation_per_m`
    width     deviation by root mean square of the errors
    memory    m of travel over which the mean is taken
    rate      rad per m: root mean square of the error, as learned so far
    scale     of the distances, as learned so far
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
        self.scale = DistanceScale()
        self._long = LongErrors()

    def corrected(self, displacement: Pose2) -> Pose2:
        """The displacement, longer or shorter if the odometry's distances are wrong."""
        factor = self.scale.factor
        return Pose2(factor * displacement.x, factor * displacement.y, displacement.theta)

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
        deviations = self.base.deviations(displacement)
        deviations[2] = self.base.rotation(displacement, self._rotation_per_m)
        return deviations

    def learn(self, displacement: Pose2, found: Pose2, covariance: Array) -> None:
        """Update rate and scale: the odometry measured `displacement`, scan matching found `found`,
        with a covariance (3, 3) that combines prediction and scan."""
        driven = math.hypot(displacement.x, displacement.y)
        if driven == 0.0:
            return
        self._long.learn(self.corrected(displacement), found)
        self._learn_scale(displacement, driven, found, covariance)
        error = math.remainder(found.theta - displacement.theta, math.tau)
        expected = math.hypot(
            self.base.rotation_per_rad * displacement.theta, self.base.rotation_floor
        )
        square = max(error**2 - expected**2, 0.0) / max(driven, MIN_DISTANCE) ** 2
        weight = min(driven / self.memory, 1.0)
        self.rate = math.sqrt((1.0 - weight) * self.rate**2 + weight * square)
        rate = max(self.width * self.rate, self.least)
        self._rotation_per_m = min(rate, self.base.rotation_per_m)

    def _learn_scale(
        self, displacement: Pose2, driven: float, found: Pose2, covariance: Array
    ) -> None:
        """Update the scale by the distance in the direction of the displacement. The prediction is
        taken out of the covariance; where the scan has no information, nothing is learned."""
        if driven < MIN_DISTANCE:
            return
        along = np.array(displacement[:2]) / driven
        variance = max(float(along @ covariance[:2, :2] @ along), MIN_VARIANCE)
        before = float(self.deviations(displacement)[0]) ** 2
        information = 1.0 / variance - 1.0 / before
        if information * before < MIN_INFORMATION_SHARE:
            return
        predicted = self.scale.factor * driven
        measured = predicted + (float(along @ found[:2]) - predicted) / (variance * information)
        self.scale.learn(driven, measured, 1.0 / information + before)
