"""A motion model that learns from the poses that were found how the odometry's heading drifts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from slam.geometry import Array, Pose2
from slam.motion.gaussian import GaussianMotion
from slam.validation import instance, number, positive_number


class LearnedOdometry:
    """Corrects a heading that errs in proportion to way and turn, as of unequal or worn wheels.

    A Kalman filter holds the two rates of the error. It begins at zero, as unsure as `base` is, and
    is told at every keyframe what the odometry said and what was found. Displacements are corrected
    by its mean; their deviations are those of its doubt and of `rest`, the part of the base's that
    stays, so that a slip of the wheels is still looked for. Translations stay as they are.

    base      how far off the odometry may be while nothing is learned
    rest      share of the base's error per metre that no bias explains
    drift     share of the base's rates by which the bias wanders within a metre: how it forgets
    bias      (2,) rad/m and rad/rad, learned so far: what the odometry's heading lacks
    doubt     (2, 2) covariance of `bias`
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
        self.doubt = np.diag(_rates(base) ** 2)
        self._wander = drift**2 * self.doubt
        self._left = replace(base, rotation_per_m=rest * base.rotation_per_m)

    def corrected(self, displacement: Pose2) -> Pose2:
        """What was probably moved. The error grew along the way: half of it turned the way."""
        error = float(self.bias @ _moved(displacement))
        turn = Pose2(0.0, 0.0, error / 2)
        return turn @ displacement @ turn

    def deviations(self, displacement: Pose2) -> Array:
        """(3,) standard deviations of what `corrected` leaves: x, y in m and theta in rad."""
        deviations = self._left.deviations(displacement)
        moved = _moved(displacement)
        deviations[2] = math.sqrt(deviations[2] ** 2 + moved @ self.doubt @ moved)
        return deviations

    def learn(self, displacement: Pose2, found: Pose2, covariance: Array) -> None:
        """The odometry said `displacement`, a match then found `found` with (3, 3) `covariance`.

        What was found is a mean of what the scan says and of what was predicted. The prediction is
        taken out of it again: where a scan said nothing, nothing is learned.
        """
        predicted, before = self.corrected(displacement), self.deviations(displacement)[2] ** 2
        self.doubt = self.doubt + self._wander * math.hypot(displacement.x, displacement.y)
        told = 1.0 / covariance[2, 2] - 1.0 / before
        if told * before < TOLD:
            return
        error = math.remainder(found.theta - predicted.theta, math.tau) / (covariance[2, 2] * told)
        moved = _moved(displacement)
        noise = 1.0 / told + self._left.deviations(displacement)[2] ** 2
        gain = self.doubt @ moved / (moved @ self.doubt @ moved + noise)
        self.bias = self.bias + gain * error
        self.doubt = self.doubt - np.outer(gain, moved @ self.doubt)


TOLD = 0.1  # of what was predicted: a scan that says less of the heading teaches nothing


def _rates(displacement: GaussianMotion) -> Array:
    return np.array([displacement.rotation_per_m, displacement.rotation_per_rad])


def _moved(displacement: Pose2) -> Array:
    """(2,) m of way and rad of turn."""
    return np.array([math.hypot(displacement.x, displacement.y), displacement.theta])
