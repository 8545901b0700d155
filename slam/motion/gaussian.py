"""Odometry motion model p(s | u, s') with Gaussian errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.matrices import transformed
from slam.validation import positive, within


@dataclass(frozen=True)
class GaussianMotion:
    """Gaussian error of a displacement, in the frame of the resulting pose.

    After Thrun, Burgard, Fox (2005), table 5.5: each deviation grows with the distance and the
    turn. The default rotation per metre is twice the paper's systematic error (3 degrees per 5 cm),
    so that a bias of that size does not outweigh a scan.

    translation_per_m    m of deviation per m driven
    translation_per_rad  m per rad turned
    translation_floor    m, of a robot at rest
    rotation_per_m       rad per m driven
    rotation_per_rad     rad per rad turned
    rotation_floor       rad, of a robot at rest
    """

    translation_per_m: float = 0.1
    translation_per_rad: float = 0.05
    translation_floor: float = 0.01
    rotation_per_m: float = math.radians(120.0)
    rotation_per_rad: float = 0.1
    rotation_floor: float = math.radians(1.5)

    def __post_init__(self) -> None:
        positive(self, "translation_floor", "rotation_floor")
        for field in fields(self):
            within(self, field.name, 0.0)

    def corrected(self, displacement: Pose2) -> Pose2:
        """The displacement unchanged."""
        return displacement

    def deviations(self, displacement: Pose2) -> Array:
        """(3,) standard deviations of x, y in m and theta in rad; the errors are independent."""
        return self.with_rotation(displacement, self.rotation_per_m)

    def with_rotation(self, displacement: Pose2, per_m: float) -> Array:
        """The same, with `per_m` in place of `rotation_per_m`."""
        translation = math.hypot(
            self.translation_per_m * math.hypot(displacement.x, displacement.y),
            self.translation_per_rad * abs(displacement.theta),
            self.translation_floor,
        )
        return np.array([translation, translation, self.rotation(displacement, per_m)])

    def rotation(self, displacement: Pose2, per_m: float) -> float:
        """rad, standard deviation of theta, with `per_m` in place of `rotation_per_m`."""
        return math.hypot(
            per_m * math.hypot(displacement.x, displacement.y),
            self.rotation_per_rad * abs(displacement.theta),
            self.rotation_floor,
        )

    def learn(self, displacement: Pose2, found: Pose2, covariance: Array) -> None:
        """Does nothing: this model does not learn."""


class Prediction:
    """p(s | u, s') of one displacement: the predicted pose, and the density of all other poses.

    An error of the heading builds up during the motion: half of it turns the displacement. Errors
    are Gaussian and independent: x, y in m and theta in rad, in the frame of the predicted pose.

    pose        where the odometry leads
    step        m, x and y from the origin to there, world
    deviations  (3,) of the errors
    """

    def __init__(self, origin: Pose2, displacement: Pose2, deviations: Array):
        self.pose = origin @ displacement
        self.step = self.pose.x - origin.x, self.pose.y - origin.y
        self.deviations = deviations
        x, y, theta = self.pose  # a list: numpy reads other sequences item by item
        c, s = math.cos(displacement.theta), math.sin(displacement.theta)
        self._centre = np.array([x, y, theta])
        self._moved = np.array(
            [c * displacement.x + s * displacement.y, c * displacement.y - s * displacement.x]
        )

    def poses(self, errors: Array) -> Array:
        """(n, 3) the poses that result from errors (n, 3)."""
        return with_errors(errors, self._centre, self._moved)

    def error(self, pose: Pose2) -> Array:
        """(3,) the error that results in a pose."""
        return np.array(_error(tuple(pose), self._centre, self._moved))

    def deviating(self, pose: Pose2) -> tuple[float, float, float]:
        """The error that results in a pose, in standard deviations."""
        return _deviating(tuple(pose), *self.gaussian)

    def within(self, deviations: float) -> tuple[float, float]:
        """m and rad of so many standard deviations."""
        return deviations * float(self.deviations[:2].max()), deviations * float(self.deviations[2])

    def log_density(self, poses: Array) -> Array:
        """(n,) log p(s | u, s') of poses (n, 3), up to a constant."""
        return log_density(poses, *self.gaussian)

    def slope(self, pose: Pose2) -> tuple[float, Array, Array]:
        """Value, gradient (3,) and (Gauss-Newton) curvature (3, 3) of the log density."""
        gradient, curvature = np.zeros(3), np.zeros((3, 3))
        return self.add_slope(pose, gradient, curvature), gradient, curvature

    def add_slope(self, pose: Pose2, gradient: Array, curvature: Array) -> float:
        """The value of the log density; its gradient and curvature are added to those given."""
        return add_slope(*pose, *self.gaussian, gradient, curvature)

    @property
    def gaussian(self) -> tuple[Array, Array, Array]:
        """What kernels evaluate the density by: (3,) the predicted pose, (2,) m, the displacement
        in the frame of that pose, and (3,) the deviations."""
        return self._centre, self._moved, self.deviations


@kernel
def with_errors(errors, centre, moved):
    """See `Prediction.poses`; `centre` and `moved` are of `Prediction.gaussian`."""
    c, s = np.cos(centre[2]), np.sin(centre[2])
    poses = np.empty_like(errors)
    for n in range(len(errors)):
        hc, hs = np.cos(errors[n, 2] / 2) - 1.0, np.sin(errors[n, 2] / 2)
        x = errors[n, 0] + hc * moved[0] - hs * moved[1]
        y = errors[n, 1] + hs * moved[0] + hc * moved[1]
        poses[n, 0] = centre[0] + c * x - s * y
        poses[n, 1] = centre[1] + s * x + c * y
        poses[n, 2] = (centre[2] + errors[n, 2] + np.pi) % (2 * np.pi) - np.pi
    return poses


@kernel
def _error(pose, centre, moved):
    """The error (x, y, theta) that results in a pose: the inverse of `with_errors`."""
    c, s = np.cos(centre[2]), np.sin(centre[2])
    dx, dy = pose[0] - centre[0], pose[1] - centre[1]
    theta = (pose[2] - centre[2] + np.pi) % (2 * np.pi) - np.pi
    hc, hs = np.cos(theta / 2) - 1.0, np.sin(theta / 2)
    x = c * dx + s * dy - hc * moved[0] + hs * moved[1]
    y = c * dy - s * dx - hs * moved[0] - hc * moved[1]
    return x, y, theta


@kernel
def _deviating(pose, centre, moved, deviations):
    """See `Prediction.deviating`; the rest is `Prediction.gaussian`."""
    x, y, theta = _error(pose, centre, moved)
    return x / deviations[0], y / deviations[1], theta / deviations[2]


@kernel
def log_density(poses, centre, moved, deviations):
    """See `Prediction.log_density`; the rest is `Prediction.gaussian`."""
    result = np.empty(len(poses))
    for n in range(len(poses)):
        x, y, theta = _deviating(poses[n], centre, moved, deviations)
        result[n] = -0.5 * (x * x + y * y + theta * theta)
    return result


@kernel
def odometry_covariance(centre, moved, deviations):
    """(3, 3) covariance of the predicted pose by the odometry's errors alone, world, of a
    prediction that is `Prediction.gaussian`."""
    c, s = np.cos(centre[2]), np.sin(centre[2])
    x, y = -0.5 * moved[1], 0.5 * moved[0]  # derivative by the heading's error
    J = np.array([[c, -s, c * x - s * y], [s, c, s * x + c * y], [0.0, 0.0, 1.0]])
    return transformed(J, np.diag(deviations * deviations))


@kernel
def add_slope(x, y, theta, centre, moved, deviations, g, H):
    """See `Prediction.add_slope`; `centre`, `moved` and `deviations` are `Prediction.gaussian`."""
    c, s = np.cos(centre[2]), np.sin(centre[2])
    x, y, theta = _error((x, y, theta), centre, moved)
    hc, hs = 0.5 * np.cos(theta / 2), 0.5 * np.sin(theta / 2)
    J = (  # derivative of the error by the pose
        (c, s, hs * moved[0] + hc * moved[1]),
        (-s, c, hs * moved[1] - hc * moved[0]),
        (0.0, 0.0, 1.0),
    )
    e, value = (x, y, theta), 0.0
    for k in range(3):
        weight, row = 1.0 / (deviations[k] * deviations[k]), J[k]
        value -= 0.5 * weight * e[k] * e[k]
        for a in range(3):
            g[a] -= weight * e[k] * row[a]
            for b in range(3):
                H[a, b] -= weight * row[a] * row[b]
    return value
