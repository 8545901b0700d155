"""Gradient and curvature of a function of the pose by central differences."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import Slope

STENCIL_STEPS = np.array([0.02, 0.02, math.radians(0.5)])  # m, m, rad: half a cell, at some 3 m
AXIS_PAIRS = ((0, 1), (0, 2), (1, 2))
UNIT_VECTORS = np.eye(3)
STENCIL = np.array(
    [np.zeros(3)]
    + [sign * UNIT_VECTORS[i] for i in range(3) for sign in (1, -1)]
    + [sign * (UNIT_VECTORS[i] + UNIT_VECTORS[j]) for i, j in AXIS_PAIRS for sign in (1, -1)]
)


def slope(function: Callable[[Array], Array], pose: Pose2) -> Slope:
    """Value, gradient and curvature at `pose` of a function (n, 3) -> (n,), from 13 values.

    The curvature is the negative semi-definite part of the Hessian, taken in units of the steps.
    """
    values = function(np.array(pose) + STENCIL * STENCIL_STEPS)
    plus, minus = values[1:7:2], values[2:7:2]
    hessian = np.diag(plus + minus - 2 * values[0])
    for k, (i, j) in enumerate(AXIS_PAIRS):
        both = values[7 + 2 * k] + values[8 + 2 * k] - 2 * values[0]
        hessian[i, j] = hessian[j, i] = (both - hessian[i, i] - hessian[j, j]) / 2
    curvature, axes = np.linalg.eigh(hessian)
    negative = (axes * np.minimum(curvature, 0.0)) @ axes.T / np.outer(STENCIL_STEPS, STENCIL_STEPS)
    return Slope(float(values[0]), (plus - minus) / (2 * STENCIL_STEPS), negative)
