"""Slow, obvious references of the kernels of dynslam_env."""

from __future__ import annotations

import math

import numpy as np


def cast(x, y, theta, angles, segments, max_range):
    """Ranges beam by beam and segment by segment: solve o + r d = p + t (q - p) for r and t."""
    ranges = []
    for angle in angles:
        d = np.array([math.cos(theta + angle), math.sin(theta + angle)])
        ranges.append(min((_hit(np.array([x, y]), d, s) for s in segments), default=math.inf))
    return np.array([r if r < max_range else math.inf for r in ranges])


def _hit(o, d, segment):
    p, q = segment[:2], segment[2:]
    system = np.column_stack([d, p - q])
    if abs(np.linalg.det(system)) < 1e-12:
        return math.inf
    r, t = np.linalg.solve(system, p - o)
    return r if r > 0 and 0 <= t <= 1 else math.inf


def leaf(door, angle):
    """Edges (4, 4) of a door's leaf turned to the world `angle`."""
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    corners = [np.array(door.hinge) + turn @ corner for corner in door.corners]
    return np.array([[*a, *b] for a, b in zip(corners, corners[1:] + corners[:1], strict=True)])
