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


def meetings(x, y, theta, angles, segments):
    """(beams, n) of all beams and all segments: how far along the beam they meet, m, and how sure.

    Sure is by how many rad the beam passes inside of the nearer (by angle) of the segment's ends;
    below zero it misses the segment. The range is inf where the beam and the line are parallel.
    """
    d = np.stack([np.cos(theta + angles), np.sin(theta + angles)], axis=1)[:, None]
    p, q = segments[:, :2] - (x, y), segments[:, 2:] - (x, y)
    n = np.stack([p[:, 1] - q[:, 1], q[:, 0] - p[:, 0]], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ranges = (n * p).sum(1) / (n * d).sum(2)
    to_p, to_q = (np.arctan2(_cross(d, e), (d * e).sum(2)) for e in (p, q))  # rad, from the beam
    sure = np.minimum(np.abs(to_p), np.abs(to_q))
    between = (to_p * to_q < 0) & (np.abs(to_p - to_q) < math.pi)
    return ranges, np.where(between, sure, -sure)


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def leaf(door, angle):
    """Edges (4, 4) of a door's leaf turned to the world `angle`."""
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    corners = [np.array(door.hinge) + turn @ corner for corner in door.corners]
    return np.array([[*a, *b] for a, b in zip(corners, corners[1:] + corners[:1], strict=True)])
