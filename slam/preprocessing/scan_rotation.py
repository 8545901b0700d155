"""Rotation of the laser between two scans, without odometry: point-to-line matching.

Chen and Medioni (1992) for planar scans, with the weights of a Cauchy loss. Both scans are used as
they were measured, each over its own sweep, so the rotation is that between the middles of the
sweeps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.kernel import kernel
from slam.scan import Scan

MAX_POINTS = 240  # of a scan; of more beams, every second, third, ... is used
STEPS = 25  # at most, of Gauss-Newton
PRECISION = 1e-5  # m and rad; shorter steps end the matching
LOSS_SCALE = (0.3, 0.05)  # m, of the Cauchy loss in the first and in the last steps
SEARCH_ANGLE = math.radians(15)  # at which a partner of a point is looked for, either side
MAX_PARTNER_DISTANCE = 0.5  # m
MAX_NEIGHBOUR_DISTANCE = 0.5  # m between points of one line
MIN_AGREEING = 0.5  # share of the points within `AGREEMENT` of a line; fewer are no match
AGREEMENT = 0.1  # m
MIN_PAIRS = 20


class Contour(NamedTuple):
    """The points of a scan by their direction, and the lines through them.

    points   (n, 2) m, in the sensor's frame
    angles   (n,) rad, increasing
    normals  (n, 2) unit normals; zero where the neighbours are on no common line
    """

    points: Array
    angles: Array
    normals: Array


def contour(scan: Scan) -> Contour:
    """The echoes of a scan, by their direction."""
    seen = np.flatnonzero(scan.hit)
    seen = seen[:: max(1, -(-len(seen) // MAX_POINTS))]
    order = np.argsort(scan.angles[seen] % math.tau, kind="stable")
    angles = scan.angles[seen][order] % math.tau
    points = scan.ranges[seen][order, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return Contour(points, angles, _normals(points))


def rotation(before: Contour, after: Contour) -> float:
    """rad by which the sensor turned from one scan to the next; NaN where they do not match."""
    return _rotation(before.points, before.angles, before.normals, after.points)


@kernel
def _normals(points):
    n = len(points)
    normals = np.zeros((n, 2))
    for k in range(1, n - 1):
        x0, y0 = points[k - 1, 0] - points[k, 0], points[k - 1, 1] - points[k, 1]
        x1, y1 = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
        a, b = math.hypot(x0, y0), math.hypot(x1, y1)
        if not (0 < a < MAX_NEIGHBOUR_DISTANCE and 0 < b < MAX_NEIGHBOUR_DISTANCE):
            continue
        if x0 * x1 + y0 * y1 > -0.9 * a * b:  # a corner
            continue
        x, y = x1 - x0, y1 - y0
        along = math.hypot(x, y)
        normals[k, 0], normals[k, 1] = -y / along, x / along
    return normals


@kernel
def _partner(points, angles, x, y):
    """The index of the nearest point in nearly the same direction; -1 if there is none near."""
    n = len(points)
    direction = math.atan2(y, x) % math.tau
    first = np.searchsorted(angles, direction)
    best, nearest = -1, MAX_PARTNER_DISTANCE * MAX_PARTNER_DISTANCE
    for side in (-1, 1):
        for step in range(n // 2 + 1):
            k = (first + side * step - (side < 0)) % n
            apart = abs(angles[k] - direction)
            if min(apart, math.tau - apart) > SEARCH_ANGLE:
                break
            dx, dy = points[k, 0] - x, points[k, 1] - y
            distance = dx * dx + dy * dy
            if distance < nearest:
                best, nearest = k, distance
    return best


@kernel
def _rotation(points, angles, normals, moving):
    tx, ty, turn = 0.0, 0.0, 0.0
    pairs, agreeing = 0, 0
    for step in range(STEPS):
        scale = max(LOSS_SCALE[1], LOSS_SCALE[0] * 0.7**step)
        c, s = math.cos(turn), math.sin(turn)
        A = np.zeros((3, 3))
        b = np.zeros(3)
        pairs, agreeing = 0, 0
        for k in range(len(moving)):
            rx, ry = c * moving[k, 0] - s * moving[k, 1], s * moving[k, 0] + c * moving[k, 1]
            x, y = rx + tx, ry + ty
            at = _partner(points, angles, x, y)
            if at < 0:
                pairs += 1
                continue
            nx, ny = normals[at, 0], normals[at, 1]
            if nx == 0.0 and ny == 0.0:
                continue
            off = nx * (points[at, 0] - x) + ny * (points[at, 1] - y)
            pairs += 1
            agreeing += abs(off) < AGREEMENT
            w = 1.0 / (1.0 + (off / scale) ** 2)
            row = (nx, ny, ny * rx - nx * ry)
            for i in range(3):
                b[i] += w * row[i] * off
                for j in range(3):
                    A[i, j] += w * row[i] * row[j]
        if pairs < MIN_PAIRS:
            return math.nan
        for i in range(3):
            A[i, i] += 1e-6 * (A[0, 0] + A[1, 1]) + 1e-12
        d = np.linalg.solve(A, b)
        tx, ty, turn = tx + d[0], ty + d[1], turn + d[2]
        if scale == LOSS_SCALE[1] and max(abs(d[0]), abs(d[1]), abs(d[2])) < PRECISION:
            break
    return turn if agreeing >= MIN_AGREEING * pairs else math.nan
