"""Laplace's approximation: what a scan knows of a pose, from the curvature of its likelihood."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import SensorModel
from slam.kernel import kernel
from slam.scan import Scan

STEPS = np.array([0.02, 0.02, 0.01])  # m, m, rad: wider than the kinks of an interpolated field
WIDE = 5.0 * STEPS  # two cells: the pattern of cells is no information
PAIRS = (0, 1), (0, 2), (1, 2)
UNIT = np.eye(3)
AXES = [np.zeros(3)] + [sign * UNIT[i] for i in range(3) for sign in (1, -1)]
ALONG = [sign * (UNIT[i] + UNIT[j]) for i, j in PAIRS for sign in (1, -1)]
AGAINST = [sign * (UNIT[i] - UNIT[j]) for i, j in PAIRS for sign in (1, -1)]
OFFSETS = STEPS * np.array(AXES + ALONG)
WIDE_OFFSETS = WIDE * np.array(AXES + ALONG + AGAINST)


def laplace(sensor_model: SensorModel, scan: Scan, pose: Pose2) -> tuple[float, Array]:
    """The log-likelihood at `pose`, and its negative Hessian (3, 3) by central differences.

    The Hessian is the information about x, y (1/m^2) and theta (1/rad^2) in the world. A direction
    in which the likelihood does not fall off holds none.
    """
    values = sensor_model.log_likelihood(scan, np.array(pose) + OFFSETS)
    return float(values[0]), _information(values, STEPS)


def wide_information(sensor_model: SensorModel, scan: Scan, pose: Pose2) -> Array:
    """The information (3, 3) by differences so wide that the likelihood levels off: to both sides
    of every diagonal, so that this binds no two axes together."""
    values = sensor_model.log_likelihood(scan, np.array(pose) + WIDE_OFFSETS)
    return _information(values, WIDE)


@kernel
def _information(values, steps):
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
    curvature, axes = np.linalg.eigh(-hessian)
    return (axes * np.maximum(curvature, 0.0)) @ axes.T / np.outer(steps, steps)
