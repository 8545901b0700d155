"""Garbled poses that are valid numbers: far from both the pose before and the one after."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Array

MAX_STEP = 50.0  # m between two messages: no robot drives that


def outliers(poses: Array) -> np.ndarray:
    """(n,) bool: which of the odometry's poses (n, 3), in file order, are single outliers.

    Such a pose lies farther than `MAX_STEP` from the one before it while the one after is near that
    again. The last one need only be far; so must the first, with the two after it near each other.
    An odometry that was reset stays where it is, and is no outlier.
    """
    points = poses[:, :2].tolist()
    found = np.zeros(len(points), dtype=bool)
    before = points[0]
    if len(points) > 2 and _far(before, points[1]) and not _far(points[1], points[2]):
        found[0] = True
        before = points[1]
    for k, point in enumerate(points[1:], start=1):
        back = k + 1 == len(points) or not _far(before, points[k + 1])
        found[k] = back and _far(before, point)
        if not found[k]:
            before = point
    return found


def _far(a: list[float], b: list[float]) -> bool:
    return math.dist(a, b) > MAX_STEP
