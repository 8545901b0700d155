"""Ray casting as kernels: exact ranges from a fan of beams to many segments."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.kernel import kernel

BLOCK_BEAMS = 16  # beams that one vectorised loop tests
PI_MARGIN = 1e-3  # rad: a segment seen under pi within this passes close by the sensor
ANGLE_ERROR = 3e-5  # rad, bound of the error of `_angle`
EDGE_ON_DISTANCE = 1e-9  # m: a segment whose line passes the sensor nearer is invisible
DOUBLE_PRECISION_FACTOR = 1.2e-3  # 1/m; lines nearer than it times max_range^2 need it


class RelativeSegment(NamedTuple):
    """A segment from p to q in the sensor's frame, m.

    mx, my  its normal over the distance of its line, 1/m: the inverse range along d is m.d
    """

    px: float
    py: float
    qx: float
    qy: float
    mx: float
    my: float


@kernel(error_model="numpy")
def look(pose, settings, fan, segments, first_edge, row, noise, lost, ranges, observed, hits):
    """Cast the beams from a robot's pose (3,), add noise, and write the measured ranges.

    settings  x, y, theta of the sensor on the robot, min_range, max_range, sigma; m and rad
    noise     (scans, beams) standard normal, of which `row` is used
    lost      (scans, beams) bool, beams without a reading; (0, 0) without dropout
    ranges    (beams,) m, written: inf for no echo, NaN for no reading
    observed  (beams,) float32 m, written: max_range for no echo, 0 for no reading

    The other arguments are those of `cast`.
    """
    mount_x, mount_y, mount_theta, min_range, max_range, sigma = settings
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x, y = pose[0] + c * mount_x - s * mount_y, pose[1] + s * mount_x + c * mount_y
    cast(x, y, pose[2] + mount_theta, fan, segments, first_edge, max_range, ranges, hits)
    for b in range(len(ranges)):
        r = ranges[b] + sigma * noise[row, b]
        if r < min_range or (len(lost) > 0 and lost[row, b]):
            ranges[b], observed[b] = np.nan, 0.0
        elif r >= max_range:
            ranges[b], observed[b] = np.inf, max_range
        else:
            ranges[b] = observed[b] = r


@kernel(error_model="numpy")
def cast(x, y, theta, fan, segments, first_edge, max_range, ranges, hits):
    """Ranges from a sensor at (x, y, theta) along a fan of beams, m; inf for none.

    A segment from p to q has a normal n, and the ray r d meets its line where r n.d = n.p. With
    m = n / n.p that is 1/r = m.d: the nearest hit is the largest inverse range, without a division.
    d hits the segment if p and q lie on different sides of d. Single precision finds *which*
    segment is hit; double precision then computes the range. (For a line at distance h from the
    sensor, single precision has an error up to 1e-7 r^2 / h: if that is large, double precision
    does both.) A segment is tested only with the blocks of beams that can hit it.

    fan       (2, beams) unit vectors, evenly spaced counter-clockwise
    segments  (n, 4) x1, y1, x2, y2, m; from index `first_edge` on, edges of solid polygons
    ranges    (beams,) written, double precision
    hits      (beams,) written: index of the segment, -1 for none
    """
    n, beams = len(segments), fan.shape[1]
    padded = (beams + BLOCK_BEAMS - 1) // BLOCK_BEAMS * BLOCK_BEAMS
    dx, dy = np.zeros(padded, dtype=np.float32), np.zeros(padded, dtype=np.float32)
    for b in range(beams):
        dx[b], dy[b] = fan[0, b], fan[1, b]
    nearest = np.full(padded, np.float32(1.0 / max_range))
    winner = np.full(padded, np.int32(-1))
    first = math.atan2(fan[1, 0], fan[0, 0])
    per_step = 1.0 / (2 * abs(first) / max(beams - 1, 1) + 1e-9)
    ahead_only = abs(first) <= math.pi / 2
    flat2, slack = (DOUBLE_PRECISION_FACTOR * max_range**2) ** 2, 1.0 + ANGLE_ERROR * per_step
    lines = np.empty((n, 3))
    c, s = math.cos(theta), math.sin(theta)
    for i in range(n):
        x1, y1, x2, y2 = segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]
        px, py = c * (x1 - x) + s * (y1 - y), c * (y1 - y) - s * (x1 - x)
        qx, qy = c * (x2 - x) + s * (y2 - y), c * (y2 - y) - s * (x2 - x)
        nx, ny = py - qy, qx - px
        offset = nx * px + ny * py
        h2, length2 = offset * offset, nx * nx + ny * ny
        if offset == 0 or (i >= first_edge and offset < 0):
            continue  # seen edge-on, or from inside the solid
        if ahead_only and max(px, qx) < -1e-6:
            continue  # behind
        lines[i, 0], lines[i, 1], lines[i, 2] = nx, ny, offset
        a, b = _angle(px, py), _angle(qx, qy)
        low = (min(a, b) - first) * per_step
        high = (max(a, b) - first) * per_step
        width, across = abs(a - b), False
        start, stop = low - slack, high + slack
        if abs(width - math.pi) < PI_MARGIN:  # passes close by the sensor, on an uncertain side
            start, stop = 0.0, float(beams)
        elif h2 < EDGE_ON_DISTANCE**2 * length2:
            continue
        elif width > math.pi:  # crosses the half-line straight behind
            start, stop, across = high - slack, float(beams), True
        segment, low = RelativeSegment(px, py, qx, qy, nx / offset, ny / offset), low + slack
        if h2 < flat2 * length2:
            _nearer(segment, i, fan[0], fan[1], nearest, winner, start, stop)
            if across:
                _nearer(segment, i, fan[0], fan[1], nearest, winner, 0.0, low)
        else:
            _nearer(segment, i, dx, dy, nearest, winner, start, stop)
            if across:
                _nearer(segment, i, dx, dy, nearest, winner, 0.0, low)
    for b in range(beams):
        i = hits[b] = winner[b]
        ranges[b] = np.inf
        if i >= 0:
            ranges[b] = lines[i, 2] / (lines[i, 0] * fan[0, b] + lines[i, 1] * fan[1, b])


@kernel(error_model="numpy")
def _angle(x, y):
    """atan2(y, x) within 2e-5 rad (Abramowitz and Stegun 1964, 4.4.49)."""
    u, v = abs(x), abs(y)
    t = min(u, v) / max(u, v)
    t2 = t * t
    a = t * (0.9998660 + t2 * (-0.3302995 + t2 * (0.1801410 + t2 * (-0.0851330 + t2 * 0.0208351))))
    a = math.pi / 2 - a if v > u else a
    a = math.pi - a if x < 0 else a
    return -a if y < 0 else a


@kernel(error_model="numpy")
def _nearer(segment: RelativeSegment, i, dx, dy, nearest, winner, low, high):
    """Write segment `i` where its inverse range is larger than `nearest`, the largest so far.

    Only beams `low` to `high` can hit it. The precision is that of `dx` and `dy`.
    """
    if high < 0 or low > len(dx):
        return
    # unsigned indices cannot be negative: otherwise the loop is not vectorised
    start = np.uint64(max(int(low), 0) // BLOCK_BEAMS * BLOCK_BEAMS)
    stop = np.uint64(min((int(high) + BLOCK_BEAMS) // BLOCK_BEAMS * BLOCK_BEAMS, len(dx)))
    real = dx.dtype.type
    px, py, qx, qy = real(segment.px), real(segment.py), real(segment.qx), real(segment.qy)
    mx, my, i = real(segment.mx), real(segment.my), np.int32(i)
    for b in range(start, stop):
        inverse = mx * dx[b] + my * dy[b]
        side_p = px * dy[b] - py * dx[b]
        side_q = qx * dy[b] - qy * dx[b]
        hit = (side_p * side_q <= 0) & (inverse > nearest[b])
        nearest[b] = inverse if hit else nearest[b]
        winner[b] = i if hit else winner[b]
