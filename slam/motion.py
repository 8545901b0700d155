"""Odometry motion model p(s | u, s'): how far the odometry may be off."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numba import njit

from slam.checked import positive, within
from slam.geometry import Array, Pose2


@dataclass(frozen=True)
class OdometryMotion:
    """Gaussian error of a displacement, in the frame of the pose that it leads to.

    After Thrun, Burgard, Fox (2005), table 5.5: each deviation grows with what was moved. The
    default turn per metre is as wide as the paper's systematic error (3 degrees per 5 cm).

    translation_per_m    m of deviation per m driven
    translation_per_rad  m per rad turned
    translation_floor    m, of a robot that stands still
    rotation_per_m       rad per m driven
    rotation_per_rad     rad per rad turned
    rotation_floor       rad
    """

    translation_per_m: float = 0.1
    translation_per_rad: float = 0.05
    translation_floor: float = 0.01
    rotation_per_m: float = math.radians(60.0)
    rotation_per_rad: float = 0.1
    rotation_floor: float = math.radians(0.5)

    def __post_init__(self) -> None:
        positive(self, "translation_floor", "rotation_floor")
        for field in fields(self):
            within(self, field.name, 0.0)

    def deviations(self, motion: Pose2) -> Array:
        """(3,) standard deviations of x, y in m and theta in rad; the errors are independent."""
        driven, turned = math.hypot(motion.x, motion.y), abs(motion.theta)
        translation = math.hypot(
            self.translation_per_m * driven,
            self.translation_per_rad * turned,
            self.translation_floor,
        )
        rotation = math.hypot(
            self.rotation_per_m * driven, self.rotation_per_rad * turned, self.rotation_floor
        )
        return np.array([translation, translation, rotation])


@njit(cache=True)
def log_prior(poses, predicted, deviations):
    """(n,) log p(s | u, s') of poses (n, 3) up to a constant, Gaussian around `predicted`."""
    c, s = np.cos(predicted[2]), np.sin(predicted[2])
    result = np.empty(len(poses))
    for n in range(len(poses)):
        dx, dy = poses[n, 0] - predicted[0], poses[n, 1] - predicted[1]
        dtheta = (poses[n, 2] - predicted[2] + np.pi) % (2 * np.pi) - np.pi
        x, y = (c * dx + s * dy) / deviations[0], (c * dy - s * dx) / deviations[1]
        result[n] = -0.5 * (x * x + y * y + (dtheta / deviations[2]) ** 2)
    return result
