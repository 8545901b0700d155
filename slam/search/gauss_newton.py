"""Gauss-Newton ascent of the log posterior (Kohlbrecher et al. 2011)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.geometry import Pose2
from slam.interface import Posterior, Slope
from slam.kernel import kernel
from slam.motion.gaussian import add_slope
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.field import slope
from slam.validation import positive, whole

DAMPING = 1e-9  # by the trace of the curvature


@dataclass(frozen=True)
class GaussNewton:
    """Newton steps on the log posterior, from the coarsest field to the finest.

    Kohlbrecher et al. (2011) minimise squared residuals of an interpolated occupancy grid, from
    coarse to fine. Here the objective is the log posterior of equation 7 itself, so that the steps
    end at its maximum; the negative semi-definite part of its Hessian gives them the direction of
    Gauss-Newton steps. A step that does not increase the objective is quartered.

    levels     number of resolutions (the sensor model may have fewer); 1: the finest alone
    steps      maximum at each resolution
    precision  m and rad; shorter steps are not taken
    """

    levels: int = 3
    steps: int = 12
    precision: float = 0.0002

    def __post_init__(self) -> None:
        whole(self, "levels", 1)
        whole(self, "steps", 1)
        positive(self, "precision")

    def __call__(self, posterior: Posterior, rng: np.random.Generator) -> Pose2:
        """Climb from the predicted pose."""
        return self.climb(posterior, posterior.prediction.pose)

    def climb(self, posterior: Posterior, start: Pose2) -> Pose2:
        """Climb from `start`."""
        return self.top(posterior, start)[0]

    def top(self, posterior: Posterior, start: Pose2) -> tuple[Pose2, Slope]:
        """The pose at which the climb from `start` ends, and the posterior around it."""
        pose = start
        for level in reversed(range(1, min(self.levels, posterior.sensor_model.levels))):
            pose, _ = self._climb(posterior, pose, level)
        return self._climb(posterior, pose, 0)

    @property
    def limits(self) -> tuple[int, float]:
        """The steps at each resolution, and the precision, as kernels take them."""
        return self.steps, self.precision

    def _climb(self, posterior: Posterior, pose: Pose2, level: int) -> tuple[Pose2, Slope]:
        model = posterior.sensor_model
        if not isinstance(model, Endpoint):
            return _ascended(posterior, pose, level, *self.limits)
        points, prior = posterior.scan.points, posterior.prediction.gaussian
        top, *here = ascended_field(tuple(pose), points, model.reading(level), prior, self.limits)
        return Pose2(*top), Slope(*here)


def _ascended(
    posterior: Posterior, pose: Pose2, level: int, steps: int, precision: float
) -> tuple[Pose2, Slope]:
    """Where the steps from a pose end, and the posterior there."""
    here = posterior.slope(pose, level)
    for _ in range(steps):
        x, y, theta = newton_step(here.gradient, here.curvature)
        while max(abs(x), abs(y), abs(theta)) > precision:
            turned = math.remainder(pose.theta + theta, math.tau)
            next_pose = Pose2(pose.x + x, pose.y + y, turned)
            there = posterior.slope(next_pose, level)
            if there.value > here.value:
                break
            x, y, theta = x / 4, y / 4, theta / 4
        else:
            break
        here, pose = there, next_pose
    return pose, here


@kernel
def ascended_field(pose, points, reading, prior, limits):
    """The same as `_ascended`, compiled: a pose; value, gradient and curvature of the posterior
    there.

    reading  see `Endpoint.reading`
    prior    see `Prediction.gaussian`
    limits   steps, precision
    """
    steps, precision = limits
    here = _slope(pose, points, reading, prior)
    for _ in range(steps):
        step = newton_step(here[1], here[2])
        next_pose, there = _higher(pose, here, step, points, reading, prior, precision)
        if there[0] <= here[0]:
            break
        pose, here = next_pose, there
    return pose, *here


@kernel
def climbed(starts, points, coarse, fine, deviations, limits):
    """(n, 3) where climbs from each of the starts (n, 3) end, first in a coarse field, and (n,) the
    posterior there.

    coarse, fine  see `Endpoint.reading`
    deviations    (3,) of a prior around each start
    limits        steps, precision
    """
    tops, values = np.empty_like(starts), np.empty(len(starts))
    for k in range(len(starts)):
        prior = starts[k].copy(), np.zeros(2), deviations
        pose = starts[k, 0], starts[k, 1], starts[k, 2]
        pose = ascended_field(pose, points, coarse, prior, limits)[0]
        pose, values[k], _, _ = ascended_field(pose, points, fine, prior, limits)
        tops[k, 0], tops[k, 1], tops[k, 2] = pose
    return tops, values


@kernel
def _higher(pose, here, step, points, reading, prior, precision):
    """The first pose along a step that is higher than `here`, or else the same; the posterior
    there."""
    x, y, theta = step
    while max(abs(x), abs(y), abs(theta)) > precision:
        turned = (pose[2] + theta + np.pi) % (2.0 * np.pi) - np.pi
        next_pose = pose[0] + x, pose[1] + y, turned
        there = _slope(next_pose, points, reading, prior)
        if there[0] > here[0]:
            return next_pose, there
        x, y, theta = x / 4, y / 4, theta / 4
    return pose, here


@kernel
def _slope(pose, points, reading, prior):
    """Value, gradient and curvature of the posterior."""
    value, g, H = slope(*pose, points, *reading)
    return value + add_slope(*pose, *prior, g, H), g, H


@kernel
def newton_step(g, H):
    """-(H - e)^-1 g by Cramer's rule, for negative semi-definite H; e keeps it invertible."""
    e = DAMPING * (1.0 - H[0, 0] - H[1, 1] - H[2, 2])
    a, b, c = e - H[0, 0], e - H[1, 1], e - H[2, 2]
    f, h, k = -H[0, 1], -H[0, 2], -H[1, 2]
    A, B, C = b * c - k * k, k * h - f * c, f * k - b * h
    D, E, F = a * c - h * h, f * h - a * k, a * b - f * f
    determinant = a * A + f * B + h * C
    return (
        (A * g[0] + B * g[1] + C * g[2]) / determinant,
        (B * g[0] + D * g[1] + E * g[2]) / determinant,
        (C * g[0] + E * g[1] + F * g[2]) / determinant,
    )
