"""Exact distances between segments and outlines.

An outline is the (k, 4) edges x1, y1, x2, y2 of a closed polygon, m.
"""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.worlds.layout import Door
from slam.geometry import Array
from slam.kernel import kernel

ARC_STEPS = 6  # edges that approximate the quarter circle of a leaf's free edge


def edges(corners: Array) -> Array:
    """(k, 4) edges of the polygon with these corners (k, 2), m."""
    return np.concatenate([corners, np.concatenate([corners[1:], corners[:1]])], axis=1)


def leaf(door: Door, angle: float) -> Array:
    """(4, 4) outline in the world of the door's leaf, opened by `angle` rad; one that slides is
    closed, or open from any angle on."""
    x, y, direction = door.place(1.0 if angle else 0.0, angle)
    return edges(_at((x, y), door.corners, direction))


def sweep(door: Door, angle: float = math.pi / 2) -> Array:
    """(k, 4) outline around the area that the leaf sweeps between closed and `angle` rad; of one
    that slides the part in its doorway."""
    if door.slides:
        return leaf(door, 0.0)
    behind = math.atan2(door.thickness, door.width)  # the outer corner of the closed leaf
    step = (angle + behind) / ARC_STEPS
    radius = math.hypot(door.width, door.thickness) / math.cos(
        step / 2
    )  # the outline encloses the arc
    turned = door.swing * (step * np.arange(ARC_STEPS + 1) - behind)
    arc = radius * np.column_stack([np.cos(turned), np.sin(turned)])
    corners = np.vstack([door.corners[3:], arc, door.corners[:1]])
    return edges(_at(door.hinge, corners, door.closed))


def _at(place: tuple[float, float], points: Array, angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return place + points @ np.array([(c, s), (-s, c)])


def clear(outline: Array, others: Array, distance: float) -> bool:
    """Whether two outlines are at least `distance` m apart, and neither is inside the other."""
    if gap(outline, others) < distance:
        return False
    return not (inside(outline, others[0, 0], others[0, 1])
                or inside(others, outline[0, 0], outline[0, 1]))  # fmt: skip


def clear_of_legs(outline: Array, legs: Array, distance: float) -> bool:
    """Whether all legs (n, 4), m, are outside the outline and at least `distance` > 0 m away."""
    if not len(legs) or not len(outline):
        return True
    return gap(outline, legs) >= distance and not any_inside(outline, legs)


def legs(points: Array) -> Array:
    """(n - 1, 4) segments from each of the points (n, 2) to the next."""
    return np.hstack([points[:-1], points[1:]])


@kernel(nogil=True)
def gap(these, those):
    """Smallest distance in m between a segment of `these` (n, 4) and one of `those` (m, 4)."""
    least = math.inf
    for i in range(len(these)):
        for j in range(len(those)):
            least = min(least, _gap2(these[i], those[j]))
    return math.sqrt(least)


@kernel(nogil=True)
def any_crossing(these, those):
    """Whether a segment of `these` (n, 4) crosses one of `those` (m, 4)."""
    crosses = False
    for i in range(len(these)):
        for j in range(len(those)):
            crosses = crosses or _cross(these[i], those[j])
    return crosses


@kernel(nogil=True)
def inside(outline, x, y):
    """Whether the point is inside the outline: a ray crosses it an odd number of times."""
    odd = False
    for k in range(len(outline)):
        x1, y1, x2, y2 = outline[k]
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
            odd = not odd
    return odd


@kernel(nogil=True)
def any_inside(outline, legs):
    """Whether the first point of any leg is inside the outline."""
    found = False
    for k in range(len(legs)):
        found = found or inside(outline, legs[k, 0], legs[k, 1])
    return found


@kernel(nogil=True)
def _gap2(a, b):
    if _cross(a, b):
        return 0.0
    return min(
        min(_point2(a[0], a[1], b), _point2(a[2], a[3], b)),
        min(_point2(b[0], b[1], a), _point2(b[2], b[3], a)),
    )


@kernel(nogil=True)
def _cross(a, b):
    return _side(a, b[0], b[1]) * _side(a, b[2], b[3]) < 0.0 and (
        _side(b, a[0], a[1]) * _side(b, a[2], a[3]) < 0.0
    )


@kernel(nogil=True)
def _side(s, x, y):
    return (s[2] - s[0]) * (y - s[1]) - (s[3] - s[1]) * (x - s[0])


@kernel(nogil=True)
def _point2(x, y, s):
    dx, dy = s[2] - s[0], s[3] - s[1]
    length2 = dx * dx + dy * dy
    t = 0.0
    if length2 > 0.0:
        t = min(max(((x - s[0]) * dx + (y - s[1]) * dy) / length2, 0.0), 1.0)
    ex, ey = x - s[0] - t * dx, y - s[1] - t * dy
    return ex * ex + ey * ey
