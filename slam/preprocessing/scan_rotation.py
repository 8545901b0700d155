"""Rotation of the laser between two scans, without odometry: point-to-line matching.

Chen and Medioni (1992), for planar scans, with the weights of a Cauchy loss. Both scans are used as
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

MAX_POINTS = 240  # of a scan; of more echoes, every second, third, ... is used
MAX_NEIGHBOUR_DISTANCE = 0.5  # m between points of one line
MAX_BEND_COSINE = -0.9  # of the angle at a point between its neighbours; at a corner it is larger
SEARCH_ANGLE = math.radians(15)  # rad, either side, within which the partner of a point lies
MAX_PARTNER_DISTANCE = 0.5  # m
FIRST_SCALE, LAST_SCALE = 0.3, 0.05  # m, of the Cauchy loss in the first and in the last steps
SCALE_DECAY = 0.7  # of the scale in each step
STEPS = 25  # at most, of Gauss-Newton
PRECISION = 1e-5  # m and rad; shorter steps end the matching
DAMPING = 1e-6  # of the normal matrix, by its share of the translation
TINY = 1e-12  # keeps the matrix invertible where no point has a partner
AGREEMENT = 0.1  # m from a point to its line, at most, to agree
MIN_AGREEING = 0.5  # share of the points that agree; fewer are no match
MIN_POINTS = 20


class Contour(NamedTuple):
    """The points of a scan by their direction, and the lines through them.

    points   (n, 2) m, in the sensor's frame
    angles   (n,) rad from 0 to 2 pi, increasing
    normals  (n, 2) unit normals of the lines; zero where the neighbours are on no common line
    """

    points: Array
    angles: Array
    normals: Array


def contour(scan: Scan) -> Contour:
    """The echoes of a scan, by their direction."""
    seen = np.flatnonzero(scan.hit)
    seen = seen[:: max(1, -(-len(seen) // MAX_POINTS))]
    seen = seen[np.argsort(scan.angles[seen] % math.tau, kind="stable")]
    angles = scan.angles[seen] % math.tau
    points = scan.ranges[seen, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return Contour(points, angles, _normals(points))


def rotation(before: Contour, after: Contour) -> float:
    """rad by which the sensor turned from one scan to the next; NaN where they do not match."""
    return _rotation(before.points, before.angles, before.normals, after.points)


@kernel
def _normals(points):
    normals = np.zeros(points.shape)
    for k in range(1, len(points) - 1):
        x0, y0 = points[k - 1, 0] - points[k, 0], points[k - 1, 1] - points[k, 1]
        x1, y1 = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
        a, b = math.hypot(x0, y0), math.hypot(x1, y1)
        near = 0 < a < MAX_NEIGHBOUR_DISTANCE and 0 < b < MAX_NEIGHBOUR_DISTANCE
        if near and x0 * x1 + y0 * y1 <= MAX_BEND_COSINE * a * b:
            along = math.hypot(x1 - x0, y1 - y0)
            normals[k, 0], normals[k, 1] = (y0 - y1) / along, (x1 - x0) / along
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
def _equations(points, angles, normals, moving, pose, scale):
    """The normal equations of a step from `pose`, the number of points that have a line or no
    partner, and that of those which agree."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    row = np.empty(3)
    counted, agreeing = 0, 0
    for k in range(len(moving)):
        rx, ry = c * moving[k, 0] - s * moving[k, 1], s * moving[k, 0] + c * moving[k, 1]
        at = _partner(points, angles, rx + pose[0], ry + pose[1])
        if at < 0:
            counted += 1
            continue
        nx, ny = normals[at, 0], normals[at, 1]
        if nx == 0.0 and ny == 0.0:
            continue
        off = nx * (points[at, 0] - rx - pose[0]) + ny * (points[at, 1] - ry - pose[1])
        counted += 1
        agreeing += abs(off) < AGREEMENT
        weight = 1.0 / (1.0 + (off / scale) ** 2)
        row[0], row[1], row[2] = nx, ny, ny * rx - nx * ry
        for i in range(3):
            b[i] += weight * row[i] * off
            for j in range(3):
                A[i, j] += weight * row[i] * row[j]
    return A, b, counted, agreeing


@kernel
def _rotation(points, angles, normals, moving):
    pose = np.zeros(3)
    counted, agreeing = 0, 0
    for step in range(STEPS):
        scale = max(LAST_SCALE, FIRST_SCALE * SCALE_DECAY**step)
        A, b, counted, agreeing = _equations(points, angles, normals, moving, pose, scale)
        if counted < MIN_POINTS:
            return math.nan
        d = np.linalg.solve(A + (DAMPING * (A[0, 0] + A[1, 1]) + TINY) * np.eye(3), b)
        pose += d
        if scale == LAST_SCALE and np.abs(d).max() < PRECISION:
            break
    return pose[2] if agreeing >= MIN_AGREEING * counted else math.nan
