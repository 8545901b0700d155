"""A motion model that learns the bias of the odometry's heading from scan matching."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from slam.geometry import Array, Pose2
from slam.motion.gaussian import GaussianMotion
from slam.motion.measured import measured
from slam.validation import instance, number, positive_number


class LearnedOdometry:
    """Corrects a heading error proportional to distance and turn, as of unequal or worn wheels.

    A Kalman filter estimates the two rates of the error. It starts at zero with the deviations of
    `base`, and is updated at every keyframe with the odometry's displacement and the one found by
    scan matching. Displacements are corrected by its mean; their deviations are those of the bias
    and of `rest`, the part of the base's that remains, so that slipping wheels stay within the
    search. Translations are not corrected.

    base      the errors of the odometry before anything is learned
    rest      share of the base's error per metre that no bias explains
    drift     random walk of the bias within a metre, as a share of the base's rates
    bias      (2,) rad/m and rad/rad, learned so far: added to the odometry's heading
    bias_covariance  (2, 2) of `bias`
    """

    def __init__(self, base: GaussianMotion | None = None, rest: float = 0.3, drift: float = 0.05):
        base = GaussianMotion() if base is None else base
        instance("LearnedOdometry.base", base, GaussianMotion)
        number("LearnedOdometry.rest", rest, 0.0, 1.0)
        positive_number("LearnedOdometry.drift", drift)
        self.base = base
        self.rest = rest
        self.drift = drift
        self.bias = np.zeros(2)
        self.bias_covariance = np.diag(_rates(base) ** 2)
        self._bias_noise = drift**2 * self.bias_covariance
        self._remaining = replace(base, rotation_per_m=rest * base.rotation_per_m)

    def corrected(self, displacement: Pose2) -> Pose2:
        """The displacement without the bias, half of which is assumed to turn the translation."""
        error = float(self.bias @ _moved(displacement))
        turn = Pose2(0.0, 0.0, error / 2)
        return turn @ displacement @ turn

    def deviations(self, displacement: Pose2) -> Array:
        """(3,) standard deviations of a corrected displacement: x, y in m and theta in rad."""
        deviations = self._remaining.deviations(displacement)
        moved = _moved(displacement)
        deviations[2] = math.sqrt(deviations[2] ** 2 + moved @ self.bias_covariance @ moved)
        return deviations

    def learn(self, displacement: Pose2, found: Pose2, covariance: Array) -> None:
        """Update the bias: the odometry measured `displacement`, scan matching found `found`.

        covariance  (3, 3) of `found`, which combines prediction and scan. The prediction is taken
                    out of it again: where the scan has no information, nothing is learned.
        """
        predicted, before = self.corrected(displacement), self.deviations(displacement)[2] ** 2
        self.bias_covariance = self.bias_covariance + self._bias_noise * math.hypot(
            displacement.x, displacement.y
        )
        error = math.remainder(found.theta - predicted.theta, math.tau)
        scan = measured(error, covariance[2, 2], before)
        if scan is None:
            return
        moved = _moved(displacement)
        noise = scan[1] + self._remaining.deviations(displacement)[2] ** 2
        gain = self.bias_covariance @ moved / (moved @ self.bias_covariance @ moved + noise)
        self.bias = self.bias + gain * scan[0]
        self.bias_covariance = self.bias_covariance - np.outer(gain, moved @ self.bias_covariance)


def _rates(displacement: GaussianMotion) -> Array:
    return np.array([displacement.rotation_per_m, displacement.rotation_per_rad])


def _moved(displacement: Pose2) -> Array:
    """(2,) distance, m, and turn, rad."""
    return np.array([math.hypot(displacement.x, displacement.y), displacement.theta])
