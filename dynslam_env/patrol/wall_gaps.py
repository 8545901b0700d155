"""Gaps and recesses of a door's width in a straight wall, with two jambs."""

from __future__ import annotations

import numpy as np

from dynslam_env.patrol.echoes import (
    MAX_DISTANCE,
    MAX_SPACING,
    MAX_WIDTH,
    MIN_BEAMS,
    MIN_WIDTH,
    MOST_SQUARE,
    Echoes,
    aside,
    is_new,
)
from slam.kernel import kernel

LEAST_SQUARE = 0.99 * MIN_WIDTH**2  # m^2, from jamb to jamb at least
WALL_TOLERANCE, WALL_SLOPE = 0.02, 0.05  # of a wall's echoes from its line: m, and per m from it
WALL_REACH, MIN_WALL = 0.35, 0.18  # m, checked on each side of the gap; least wall found there
MIN_RECESS = 0.04  # m, of a closed leaf behind the wall's face
JAMB_MARGIN = 0.1  # m beside a jamb in which its own side shows
MAX_RECESS = 0.2  # m: farther behind the wall's face there is no closed leaf


@kernel
def wall_gaps(echoes: Echoes, found):
    """Write rows of `suspects` (n, 5) to `found`; how many. Doorways seen through another one are
    among them."""
    x, y, ranges, angles, spacing = echoes.x, echoes.y, echoes.ranges, echoes.angles, echoes.spacing
    count, n = 0, len(echoes.x)
    for i in range(1, n - MIN_BEAMS - 2):
        before = spacing[i]
        if not (ranges[i] < MAX_DISTANCE and before < MAX_SPACING):
            continue
        last = angles[i] + aside(ranges[i], angles[-1] - angles[0])
        for j in range(i + MIN_BEAMS + 1, n - 1):
            if angles[j] > last:
                break
            after = spacing[j + 1]
            if not (ranges[j] < MAX_DISTANCE and after < MAX_SPACING):
                continue
            square = (x[j] - x[i]) ** 2 + (y[j] - y[i]) ** 2
            if square < LEAST_SQUARE or square > MOST_SQUARE:
                continue
            width = np.hypot(x[j] - x[i], y[j] - y[i])
            if width < MIN_WIDTH or width > MAX_WIDTH + 2.0 * MAX_SPACING:
                continue
            if width - before - after > MAX_WIDTH:
                continue
            middle = (x[i] + x[j]) / 2, (y[i] + y[j]) / 2
            if not is_new(found, count, *middle):
                continue
            closed = _between(x, y, i, j, width)
            if closed < 0 or not _walls(x, y, i, j, width):
                continue
            found[count, 0], found[count, 1] = middle
            found[count, 2] = np.arctan2(y[j] - y[i], x[j] - x[i])
            found[count, 3] = width - (before + after) / 2.0
            found[count, 4] = closed
            count += 1
            break
    return count


@kernel
def _between(x, y, i, j, width):
    """Whether a leaf closes the gap between the jambs, 0 or 1; -1: no gap."""
    ux, uy = (x[j] - x[i]) / width, (y[j] - y[i]) / width
    inner, recessed = 0, 0
    for k in range(i + 1, j):
        if np.isnan(x[k]):
            continue
        along = (x[k] - x[i]) * ux + (y[k] - y[i]) * uy
        deep = (x[k] - x[i]) * uy - (y[k] - y[i]) * ux  # bearings rise: behind is to the right
        if deep < 1.0 and (along < JAMB_MARGIN or along > width - JAMB_MARGIN):
            continue
        inner += 1
        if deep < MIN_RECESS:
            return -1
        recessed += deep < MAX_RECESS
    if inner < MIN_BEAMS:
        return -1
    return 1 if recessed == inner else 0


@kernel
def _walls(x, y, i, j, width):
    """Whether the wall goes on in line on both sides of the gap."""
    return _wall(x, y, i, j, width, -1) and _wall(x, y, i, j, width, 1)


@kernel
def _wall(x, y, i, j, width, side):
    """Whether the wall goes on in line before beam `i` (side -1) or after beam `j` (side 1)."""
    ux, uy = (x[j] - x[i]) / width, (y[j] - y[i]) / width
    at, reach = (i, 0.0) if side < 0 else (j, 0.0)
    k = at + side
    while 0 <= k < len(x):
        if not np.isnan(x[k]):
            out = side * ((x[k] - x[at]) * ux + (y[k] - y[at]) * uy)
            off = abs((x[k] - x[at]) * uy - (y[k] - y[at]) * ux)
            if off > WALL_TOLERANCE + WALL_SLOPE * abs(out) or out < -WALL_TOLERANCE:
                break
            reach = out
            if out > WALL_REACH:
                break
        k += side
    return reach >= MIN_WALL
