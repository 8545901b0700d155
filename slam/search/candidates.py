"""The likeliest of many candidate poses, in a likelihood field."""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel
from slam.maps.tiles import SHIFT
from slam.sensor_models.field import U_MASK, U_SHIFT, pose_sum

CLOSE = 20.0  # of a sum over a field; in 16,000 matches of three logs the best candidate was always
# so close to the best one by cells
ROUNDING = 1e-6  # nats, of sums that are compared with a floor
PART = 32  # echoes, after which it is asked whether a candidate can still be the best


@kernel
def likeliest(poses, priors, group, points, index, field, origin, resolution, unknown, top, beta):
    """The number of the pose (of (n, 3)) with the largest sum over the points of the field, times
    `beta`, plus its log prior (n,); the first of equal ones.

    All are compared by the cells that the points lie in; those that are CLOSE to the best one then
    on the interpolated field: no bound makes sure that the largest is among them. Each `group` of
    poses has one heading.
    """
    values = _by_cells(
        poses, priors, group, points, index, field, origin, resolution, unknown, top, beta
    )
    least, best, found = values.max() - beta * CLOSE, -np.inf, 0
    for n in range(len(poses)):
        if values[n] >= least:
            floor = (best - priors[n]) / beta - ROUNDING
            total = pose_sum(poses[n, 0], poses[n, 1], poses[n, 2], points, index, field, origin,
                             resolution, unknown, floor, top)  # fmt: skip
            value = beta * total + priors[n]
            if value > best:
                best, found = value, n
    return found


@kernel
def _by_cells(poses, priors, group, points, index, field, origin, resolution, unknown, top, beta):
    """(n,) the values by the cells that the points lie in; -inf where it is certain that another
    one is larger by CLOSE. The most probable headings, and poses of a heading, are tried first."""
    if not len(points):
        return priors.copy()
    scale, best, values = 1.0 / resolution, -np.inf, np.empty(len(poses))
    x, y = np.empty(len(points)), np.empty(len(points))  # cells, from the robot
    for heading in np.argsort(-priors[group // 2 :: group], kind="mergesort"):
        first = heading * group
        c, s = np.cos(poses[first, 2]) * scale, np.sin(poses[first, 2]) * scale
        for k in range(len(points)):
            x[k] = c * points[k, 0] - s * points[k, 1]
            y[k] = s * points[k, 0] + c * points[k, 1]
        box = x.min(), y.min(), x.max(), y.max()
        for within in np.argsort(-priors[first : first + group], kind="mergesort"):
            n = first + within
            col, row = (poses[n, 0] - origin[0]) * scale, (poses[n, 1] - origin[1]) * scale
            floor = (best - priors[n]) / beta - CLOSE
            total = _cell_sum(col, row, x, y, box, index, field, unknown, floor, top)
            values[n] = beta * total + priors[n]
            best = max(best, values[n])
    return values


@kernel
def _cell_sum(col, row, x, y, box, index, field, unknown, floor, top):
    """The sum of the field over the cells of points (x, y) from a column and a row; -inf as soon as
    it must be below `floor`. `box` holds the least and the largest x and y."""
    left, low, right, high = box
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    inside = col + left >= 0.0 and row + low >= 0.0 and col + right < cols and row + high < rows
    total = 0.0
    for begin in range(0, len(x), PART):
        if total + (len(x) - begin) * top < floor:
            return -np.inf
        for k in range(begin, min(begin + PART, len(x))):
            at = np.uint64(k)
            if inside or (0.0 <= col + x[at] < cols and 0.0 <= row + y[at] < rows):
                i, j = np.uint64(np.int64(row + y[at])), np.uint64(np.int64(col + x[at]))
                slot = np.uint64(index[i >> U_SHIFT, j >> U_SHIFT])
                cell = (slot << (U_SHIFT + U_SHIFT)) + ((i & U_MASK) << U_SHIFT) + (j & U_MASK)
                total += field[cell]
            else:
                total += unknown
    return total
