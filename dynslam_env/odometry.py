"""What the wheels believe the robot moved: the truth, with a systematic and a random error."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.checked import within
from slam.geometry import Pose2

STILL = 1e-4  # m: below it a step is a turn on the spot, and its direction means nothing


@dataclass(frozen=True)
class Odometry:
    """Both errors; either is off at zero.

    bias    rad per m travelled, believed as rotation. 3 degrees per 5 cm (the paper): a straight
            drive looks like a circle of radius 1 / bias = 0.95 m
    alpha1  rad^2 / rad^2, variance of a rotation from rotation
    alpha2  rad^2 / m^2, variance of a rotation from translation
    alpha3  m^2 / m^2, variance of a translation from translation
    alpha4  m^2 / rad^2, variance of a translation from rotation

    The alphas: Thrun, Burgard, Fox (2005), Probabilistic Robotics, table 5.6, where sample(b^2)
    draws with variance b^2.
    """

    bias: float = math.pi / 3
    alpha1: float = 0.0025
    alpha2: float = 0.001
    alpha3: float = 0.0025
    alpha4: float = 0.001

    def __post_init__(self) -> None:
        within(self, "bias", -math.inf)
        for name in ("alpha1", "alpha2", "alpha3", "alpha4"):
            within(self, name, 0.0)

    def reading(self, moved: Pose2, rng: np.random.Generator) -> Pose2:
        """The displacement that the wheels report for the true one (both in the robot's frame).

        Always draws three numbers, so that the noise of later steps depends on no earlier motion.
        """
        e1, e2, e3 = rng.standard_normal(3).tolist()
        travelled = math.hypot(moved.x, moved.y)
        forward = math.copysign(1.0, moved.x)
        course = math.atan2(forward * moved.y, forward * moved.x)
        rot1 = course if travelled > STILL else 0.0
        rot2, trans = moved.theta - rot1, forward * travelled
        t2, r1, r2 = trans**2, rot1**2, rot2**2
        first = e1 * math.sqrt(self.alpha1 * r1 + self.alpha2 * t2) + self.bias * travelled / 2
        length = e2 * math.sqrt(self.alpha3 * t2 + self.alpha4 * (r1 + r2))
        second = e3 * math.sqrt(self.alpha1 * r2 + self.alpha2 * t2) + self.bias * travelled / 2
        return _arc(course + first, trans + length, moved.theta - course + second)


def _arc(rot1: float, trans: float, rot2: float) -> Pose2:
    """Turn, drive, turn."""
    theta = math.remainder(rot1 + rot2, math.tau)
    return Pose2(trans * math.cos(rot1), trans * math.sin(rot1), theta)
