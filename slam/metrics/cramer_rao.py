"""The Cramer-Rao bound of a pose estimated from a laser scan in a known map.

Source: Censi (2007), "On achievable accuracy for range-finder localization", for independent
Gaussian noise of the ranges; the recursion over time as in Tichavsky, Muravchik, Nehorai (1998),
"Posterior Cramer-Rao bounds for discrete-time nonlinear filtering", for a linearised motion.

Covariances and informations are of (x, y, theta), (3, 3), m and rad, world frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2, lever_jacobian, transform_points
from slam.validation import finite, positive_number

MIN_COSINE = 0.05  # lower limit on the cosine of incidence, for grazing beams
SINGULAR = 1e-12  # relative to the largest eigenvalue: below it, a direction counts as unknown


class Bound(NamedTuple):
    """No unbiased estimate of the pose has a smaller covariance.

    std_x, std_y  m
    std_theta     rad
    covariance    (3, 3)

    If the scan has no information on a direction, the bound along it is infinite: `covariance` is
    the limit of (information + e identity)^-1 for e -> 0, so that what is known stays finite. In an
    endless corridor along x, std_x is inf; along a diagonal, std_x and std_y are, while std_theta
    is finite.
    """

    std_x: float
    std_y: float
    std_theta: float
    covariance: Array


def ray_gradient(
    pose: Pose2, angles: Array, ranges: Array, normals: Array, mount: Pose2 = Pose2()
) -> Array:
    """(beams, 3) derivatives of the exact ranges by the robot's x, y (m/m) and theta (m/rad).

    pose     of the robot in the world
    angles   (beams,) rad, in the sensor's frame
    ranges   (beams,) m, exact; without an echo (inf or NaN) the row is zero
    normals  (beams, 2) unit vectors, world, of the surfaces that were hit; of either sign
    mount    robot_from_sensor: a sensor off the robot's centre also moves when the robot turns

    A ray from s in direction d ends on the line through h with normal n: n.(s + r d) = n.h. Hence
    dr/ds = -n / n.d, and dr/dtheta = -n.(h - p)_perp / n.d, about the robot's centre p. |n.d|, the
    cosine of the incidence, counts as `MIN_COSINE` at least. Errors: InputError for wrong shapes.
    """
    hit = np.isfinite(ranges)
    _check(angles, ranges, normals, hit)
    directions = np.stack([np.cos(angles[hit]), np.sin(angles[hit])], axis=1)
    arms = transform_points(pose, transform_points(mount, ranges[hit, None] * directions))
    arms -= pose[:2]  # from the robot's centre to the hits
    d = transform_points(Pose2(0.0, 0.0, pose.theta + mount.theta), directions)
    n = normals[hit]
    cosine = (n * d).sum(axis=1)
    cosine = np.copysign(np.maximum(np.abs(cosine), MIN_COSINE), cosine)
    gradient = np.zeros((len(ranges), 3))
    gradient[hit, :2] = -n / cosine[:, None]
    gradient[hit, 2] = -(n[:, 1] * arms[:, 0] - n[:, 0] * arms[:, 1]) / cosine
    return gradient


def information(gradient: Array, sigma: float) -> Array:
    """(3, 3) Fisher information about the pose: sigma^-2 sum_k g_k g_k^T.

    gradient  (beams, 3) of `ray_gradient`
    sigma     m, standard deviation of every range
    """
    finite("gradient", gradient, 3)
    positive_number("sigma", sigma)
    return gradient.T @ gradient / sigma**2


def bound(information: Array) -> Bound:
    """The smallest covariance that an estimate with this `information` (3, 3) can have."""
    _symmetric("information", information)
    values, vectors = np.linalg.eigh(information)
    if values[0] < -1e-9 * abs(values[-1]):
        raise InputError(
            f"information must be positive semi-definite, got eigenvalues {values.tolist()}"
        )
    known = values > SINGULAR * values[-1]
    covariance = (vectors[:, known] / values[known]) @ vectors[:, known].T
    unknown = vectors[:, ~known] @ vectors[:, ~known].T  # projects onto unobservable directions
    reached = np.abs(unknown) > math.sqrt(SINGULAR)
    covariance[reached] = np.copysign(np.inf, unknown[reached])
    std_x, std_y, std_theta = np.sqrt(covariance.diagonal()).tolist()
    return Bound(std_x, std_y, std_theta, covariance)


def transition(before: Pose2, after: Pose2) -> Array:
    """(3, 3) F = d after / d before: Jacobian of the pose after a motion by the pose before it.

    The motion is fixed in the robot's frame, so a heading error before it rotates the displacement.
    """
    return lever_jacobian(after.x - before.x, after.y - before.y)


def tracked(before: Array, F: Array, Q: Array, measured: Array) -> Array:
    """(3, 3) J_t = I_t + (Q + F J_{t-1}^-1 F^T)^-1: the information after a motion and a scan.

    before    J_{t-1}; may be singular; zeros for an unknown start
    F         `transition` of the motion
    Q         covariance of the motion's noise, at its end; may be singular, zeros for none
    measured  I_t, the `information` of the scan; zeros if there was none

    Computed as (identity + M Q)^-1 M, M = F^-T J F^-1, which inverts neither J nor Q.
    """
    for name, matrix in {"before": before, "Q": Q, "measured": measured}.items():
        _symmetric(name, matrix)
    _square("F", F)
    back = np.linalg.inv(F)
    moved = back.T @ before @ back
    predicted = np.linalg.solve(np.eye(3) + moved @ Q, moved)
    return measured + (predicted + predicted.T) / 2


def _check(angles: Array, ranges: Array, normals: Array, hit: np.ndarray) -> None:
    n = len(angles)
    if angles.shape != (n,) or ranges.shape != (n,) or normals.shape != (n, 2):
        raise InputError(
            f"angles, ranges and normals have shapes (n,), (n,) and (n, 2), got "
            f"{angles.shape}, {ranges.shape} and {normals.shape}"
        )
    lengths = np.hypot(*normals[hit].T)
    if not (np.abs(lengths - 1) < 1e-6).all():
        raise InputError(f"normals must be unit vectors wherever a beam hits, got {lengths}")


def _square(name: str, matrix: Array) -> None:
    if matrix.shape != (3, 3):
        raise InputError(f"{name} must have shape (3, 3), got {matrix.shape}")
    finite(name, matrix)


def _symmetric(name: str, matrix: Array) -> None:
    _square(name, matrix)
    if np.abs(matrix - matrix.T).max() > 1e-9 * np.abs(matrix).max():
        raise InputError(f"{name} must be symmetric, got {matrix.tolist()}")
