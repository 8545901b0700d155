"""Odometry motion model p(s | u, s'): how far the odometry may be off."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

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

    def covariance(self, motion: Pose2) -> Array:
        """(3, 3) diagonal covariance of x, y in m and theta in rad."""
        driven, turned = math.hypot(motion.x, motion.y), abs(motion.theta)
        translation = (
            (self.translation_per_m * driven) ** 2
            + (self.translation_per_rad * turned) ** 2
            + self.translation_floor**2
        )
        rotation = (
            (self.rotation_per_m * driven) ** 2
            + (self.rotation_per_rad * turned) ** 2
            + self.rotation_floor**2
        )
        return np.diag([translation, translation, rotation])
