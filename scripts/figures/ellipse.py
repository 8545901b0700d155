"""Confidence ellipses of a position."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array

SIGMAS_95 = 2.4477  # radius, in sigmas, that holds 95 % of a normal distribution in the plane


def ellipses(covariances: Array) -> tuple[Array, Array]:
    """95 % ellipses of covariances (n, 3, 3): half axes (n, 2), m; headings of the first, rad."""
    variances, axes = np.linalg.eigh(covariances[:, :2, :2])
    return SIGMAS_95 * np.sqrt(np.maximum(variances, 0.0)), np.arctan2(axes[:, 1, 0], axes[:, 0, 0])


def outline(covariance: Array, points: int = 36) -> Array:
    """(points, 2) on the 95 % ellipse of a covariance (3, 3), m, relative to the position."""
    (half,), (heading,) = ellipses(covariance[None])
    angle = np.linspace(0.0, 2 * np.pi, points, endpoint=False)
    x, y = half[0] * np.cos(angle), half[1] * np.sin(angle)
    c, s = np.cos(heading), np.sin(heading)
    return np.column_stack([c * x - s * y, s * x + c * y])
