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
    x, y = door.hinge
    return _sweep(x, y, door.closed, door.swing, door.width, door.thickness, angle)


@kernel(nogil=True)
def _sweep(x, y, closed, swing, width, thickness, angle):
    """See `sweep`: from the leaf's outer corner at the hinge along an arc back to the hinge."""
    behind = math.atan2(thickness, width)  # the outer corner of the closed leaf
    step = (angle + behind) / ARC_STEPS
    radius = math.hypot(width, thickness) / math.cos(step / 2)  # the outline encloses the arc
    corners = np.zeros((ARC_STEPS + 3, 2))
    corners[0, 1] = -swing * thickness
    for k in range(ARC_STEPS + 1):
        turned = swing * (step * k - behind)
        corners[k + 1] = radius * math.cos(turned), radius * math.sin(turned)
    c, s, n = math.cos(closed), math.sin(closed), len(corners)
    outline = np.empty((n, 4))
    for k in range(n):
        px, py = (
            x + (c * corners[k, 0] - s * corners[k, 1]),
            (y + (s * corners[k, 0] + c * corners[k, 1])),
        )
        outline[k, 0] = outline[k - 1, 2] = px
        outline[k, 1] = outline[k - 1, 3] = py
    return outline


def _at(place: tuple[float, float], points: Array, angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return place + points @ np.array([(c, s), (-s, c)])


def legs(points: Array) -> Array:
    """(n - 1, 4) segments from each of the points (n, 2) to the next."""
    both = np.empty((len(points) - 1, 4))
    both[:, :2], both[:, 2:] = points[:-1], points[1:]
    return both


@kernel(nogil=True)
def gap(these, those):
    """Smallest distance in m between a segment of `these` (n, 4) and one of `those` (m, 4)."""
    least = math.inf
    for i in range(len(these)):
        for j in range(len(those)):
            least = min(least, _gap2(these[i], those[j]))
    return math.sqrt(least)


@kernel(nogil=True)
def clear(outline, others, distance):
    """Whether two outlines are at least `distance` m apart, and neither is inside the other."""
    return farther(outline, others, distance) and not (
        inside(outline, others[0, 0], others[0, 1]) or inside(others, outline[0, 0], outline[0, 1])
    )


@kernel(nogil=True)
def clear_of_legs(outline, legs, distance):
    """Whether all legs (n, 4), m, are outside the outline and at least `distance` > 0 m away."""
    return farther(outline, legs, distance) and not any_inside(outline, legs)


@kernel(nogil=True)
def farther(these, those, distance):
    """Whether all segments of `these` are at least `distance` m from all of `those`."""
    if not len(these) or not len(those):
        return True
    left, bottom, right, top = _box(those)
    for i in range(len(these)):
        one = these[i]
        if _beside(one, left, bottom, right, top) > distance:
            continue
        for j in range(len(those)):
            x1, y1, x2, y2 = those[j]
            left2, right2, bottom2, top2 = min(x1, x2), max(x1, x2), min(y1, y2), max(y1, y2)
            if _beside(one, left2, bottom2, right2, top2) > distance:
                continue
            if math.sqrt(_gap2(one, those[j])) < distance:
                return False
    return True


@kernel(nogil=True)
def _beside(segment, left, bottom, right, top):
    """A lower bound of the distance of a segment from what is in a box, m."""
    x1, y1, x2, y2 = segment
    return max(left - max(x1, x2), min(x1, x2) - right, bottom - max(y1, y2), min(y1, y2) - top)


@kernel(nogil=True)
def _box(segments):
    """Left, bottom, right and top of some segments, m."""
    left, bottom, right, top = math.inf, math.inf, -math.inf, -math.inf
    for k in range(len(segments)):
        x1, y1, x2, y2 = segments[k]
        left, right = min(left, x1, x2), max(right, x1, x2)
        bottom, top = min(bottom, y1, y2), max(top, y1, y2)
    return left, bottom, right, top


@kernel(nogil=True)
def any_crossing(these, those):
    """Whether a segment of `these` (n, 4) crosses one of `those` (m, 4)."""
    crosses = False
    for i in range(len(these)):
        for j in range(len(those)):
            crosses = crosses or _cross(these[i], those[j])
    return crosses


@kernel(nogil=True)
def first_crossed(these, those):
    """(n,) for each segment of `these` (n, 4) the first of `those` (m, 4) that it crosses, or
    -1."""
    crossed = np.full(len(these), -1)
    for i in range(len(these)):
        for j in range(len(those) - 1, -1, -1):
            if _cross(these[i], those[j]):
                crossed[i] = j
    return crossed


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
