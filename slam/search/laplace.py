"""Laplace's approximation: the covariance of a pose from the curvature of its log posterior."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import Objective

STEPS = np.array([0.02, 0.02, 0.01])  # m, m, rad: wider than the kinks of an interpolated field
PAIRS = ((0, 1), (0, 2), (1, 2))
UNIT = np.eye(3)
STENCIL = np.array(
    [np.zeros(3)]
    + [sign * UNIT[i] for i in range(3) for sign in (1, -1)]
    + [sign * (UNIT[i] + UNIT[j]) for i, j in PAIRS for sign in (1, -1)]
)


def laplace_covariance(objective: Objective, pose: Pose2, deviations: Array) -> Array:
    """(3, 3) inverse of the negative Hessian of `objective` at `pose`, by central differences.

    A direction in which the posterior falls off less than the motion's own `deviations` (3,) say
    keeps these: the scan added nothing there.
    """
    values = objective(np.array(pose) + STENCIL * STEPS)
    hessian = np.zeros((3, 3))
    for i in range(3):
        hessian[i, i] = values[1 + 2 * i] + values[2 + 2 * i] - 2 * values[0]
    for k, (i, j) in enumerate(PAIRS):
        both = values[7 + 2 * k] + values[8 + 2 * k] - 2 * values[0]
        hessian[i, j] = hessian[j, i] = (both - hessian[i, i] - hessian[j, j]) / 2
    whitened = -hessian * np.outer(deviations / STEPS, deviations / STEPS)
    curvature, axes = np.linalg.eigh(whitened)
    variance = 1.0 / np.maximum(curvature, 1.0)
    return (axes * variance) @ axes.T * np.outer(deviations, deviations)
