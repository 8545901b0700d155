"""Laplace approximation: information about a pose from the curvature of the log-likelihood."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import SensorModel
from slam.kernel import kernel
from slam.scan import Scan
from slam.sensor_models.differences import AXIS_PAIRS, STENCIL, UNIT_VECTORS

NARROW_STEPS = np.array([0.02, 0.02, 0.01])  # m, m, rad: wider than the kinks of a field
WIDE_STEPS = 5.0 * NARROW_STEPS  # two cells: the pattern of cells is no information
DIFFERENCES = [
    sign * (UNIT_VECTORS[i] - UNIT_VECTORS[j]) for i, j in AXIS_PAIRS for sign in (1, -1)
]
NARROW_STENCIL = NARROW_STEPS * STENCIL
WIDE_STENCIL = WIDE_STEPS * np.vstack([STENCIL, DIFFERENCES])


def laplace(sensor_model: SensorModel, scan: Scan, pose: Pose2) -> tuple[float, Array]:
    """The log-likelihood at `pose`, and its negative Hessian (3, 3) by central differences.

    The Hessian is the information about x, y (1/m^2) and theta (1/rad^2) in the world. Directions
    in which the likelihood does not decrease have zero information.
    """
    values = sensor_model.log_likelihood(scan, np.array(pose) + NARROW_STENCIL)
    return float(values[0]), _information(values, NARROW_STEPS)


def wide_information(sensor_model: SensorModel, scan: Scan, pose: Pose2) -> Array:
    """The information (3, 3) by differences so wide that the likelihood levels off.

    They are taken along the principal axes of the position's narrow information: at 45 degrees to a
    wall the likelihood levels off before it has fallen by as much as the diagonal differences tell,
    which would be information along the wall. Mixed derivatives use both diagonals, so that the
    levelling-off correlates no two axes.
    """
    _, narrow = laplace(sensor_model, scan, pose)
    axes = np.eye(3)
    axes[:2, :2] = np.linalg.eigh(narrow[:2, :2])[1]
    values = sensor_model.log_likelihood(scan, np.array(pose) + WIDE_STENCIL @ axes.T)
    return axes @ _information(values, WIDE_STEPS) @ axes.T


@kernel
def _information(values, steps):
    """The positive semi-definite part of the negative Hessian, by the values at a stencil."""
    hessian = np.zeros((3, 3))
    for i in range(3):
        hessian[i, i] = values[1 + 2 * i] + values[2 + 2 * i] - 2 * values[0]
    n = 7
    for i in range(3):
        for j in range(i + 1, 3):
            mixed = values[n] + values[n + 1]
            if len(values) > 13:
                mixed = (mixed - values[n + 6] - values[n + 7]) / 4
            else:
                mixed = (mixed - 2 * values[0] - hessian[i, i] - hessian[j, j]) / 2
            hessian[i, j] = hessian[j, i] = mixed
            n += 2
    if positive(-hessian):
        return -hessian / np.outer(steps, steps)
    curvature, axes = np.linalg.eigh(-hessian)
    return (axes * np.maximum(curvature, 0.0)) @ axes.T / np.outer(steps, steps)


@kernel
def positive(a):
    """Whether a symmetric (3, 3) matrix is positive definite, by its leading minors."""
    two = a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1]
    three = a[2, 2] * two - a[0, 0] * a[1, 2] ** 2 - a[1, 1] * a[0, 2] ** 2
    return a[0, 0] > 0.0 and two > 0.0 and three + 2.0 * a[0, 1] * a[0, 2] * a[1, 2] > 0.0
