"""The slope of a reading that has none in closed form, by central differences."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import Slope

STEPS = np.array([0.02, 0.02, math.radians(0.5)])  # m, m, rad: about half a cell, at some 3 m
PAIRS = ((0, 1), (0, 2), (1, 2))
UNIT = np.eye(3)
STENCIL = np.array(
    [np.zeros(3)]
    + [sign * UNIT[i] for i in range(3) for sign in (1, -1)]
    + [sign * (UNIT[i] + UNIT[j]) for i, j in PAIRS for sign in (1, -1)]
)


def slope(function: Callable[[Array], Array], pose: Pose2) -> Slope:
    """Value, gradient and curvature at `pose` of a function (n, 3) -> (n,), from 13 values.

    The curvature is the part of the Hessian that bends down, in units in which the steps are equal.
    """
    values = function(np.array(pose) + STENCIL * STEPS)
    plus, minus = values[1:7:2], values[2:7:2]
    hessian = np.diag(plus + minus - 2 * values[0])
    for k, (i, j) in enumerate(PAIRS):
        both = values[7 + 2 * k] + values[8 + 2 * k] - 2 * values[0]
        hessian[i, j] = hessian[j, i] = (both - hessian[i, i] - hessian[j, j]) / 2
    curvature, axes = np.linalg.eigh(hessian)
    bent = (axes * np.minimum(curvature, 0.0)) @ axes.T / np.outer(STEPS, STEPS)
    return Slope(float(values[0]), (plus - minus) / (2 * STEPS), bent)
