"""Ellipses of how sure a position is."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array

SURE = 2.4477  # sigmas of a plane's normal distribution that hold 95 % of it


def ellipses(covariances: Array) -> tuple[Array, Array]:
    """(n, 2) half axes in m that hold the positions with 95 %, and the headings of the first, rad,
    of covariances (n, 3, 3)."""
    variances, axes = np.linalg.eigh(covariances[:, :2, :2])
    return SURE * np.sqrt(np.maximum(variances, 0.0)), np.arctan2(axes[:, 1, 0], axes[:, 0, 0])


def outline(covariance: Array, points: int = 36) -> Array:
    """(points, 2) around the ellipse of covariance (3, 3), m from the position."""
    (half,), (heading,) = ellipses(covariance[None])
    angle = np.linspace(0.0, 2 * np.pi, points, endpoint=False)
    x, y = half[0] * np.cos(angle), half[1] * np.sin(angle)
    c, s = np.cos(heading), np.sin(heading)
    return np.column_stack([c * x - s * y, s * x + c * y])
