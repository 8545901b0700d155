"""Open doors by their leaf: a wall ends, and a leaf stands square to it beyond a gap.

`wall_gaps` misses such a doorway if the leaf hides the wall at one jamb, or if that wall is short.
"""

from __future__ import annotations

import numpy as np

from dynslam_env.patrol.door_looks import looked_at
from dynslam_env.patrol.echoes import (
    MAX_DISTANCE,
    MAX_SPACING,
    MAX_WIDTH,
    MIN_BEAMS,
    MIN_WIDTH,
    Echoes,
    aside,
    is_new,
)
from dynslam_env.patrol.open_leaf import MIN_DEPTH, MIN_ECHOES, OVERHANG
from slam.kernel import kernel

MIN_STEP = 0.1  # m from the wall's end to the next echo
MIN_ROW, MAX_ROW = 0.25, 0.6  # m of the wall before its end, which tell its direction
ROW_TOLERANCE = 0.03  # m, of its echoes
HALF_LEAF = 0.02  # m, half of a leaf's depth
MIN_SEEN = 0.75  # share of the leaf's width that is seen
MAX_SPREAD = 0.05  # m, standard deviation of the leaf's echoes along the wall


@kernel
def leaf_doorways(echoes: Echoes, found, count):
    """Add rows of `suspects` to the first `count` of `found` (n, 5); how many they are then."""
    for end in range(1, len(echoes.x) - 1):
        if not echoes.ranges[end] < MAX_DISTANCE:
            continue
        for step in (1, -1):  # to beams of the gap
            wall = echoes.spacing[end if step > 0 else end + 1]
            gap = echoes.spacing[end + 1 if step > 0 else end]
            if not (wall < MAX_SPACING and gap > MIN_STEP):
                continue
            ux, uy = _direction(echoes.x, echoes.y, end, step)
            if np.isnan(ux) or _goes_on(echoes.x, echoes.y, end, end + step, ux, uy):
                continue
            width = _leaf(echoes, end, step, ux, uy)
            x, y = echoes.x[end] + width / 2 * ux, echoes.y[end] + width / 2 * uy
            if np.isnan(width) or not is_new(found, count, x, y):
                continue
            place = np.array([x, y, np.arctan2(uy, ux), width])
            reached, ended, leaf, _ = looked_at(
                echoes.ranges, echoes.beams, echoes.sensor, echoes.longest, place
            )  # fmt: skip
            if leaf and reached >= MIN_BEAMS and not ended:
                found[count, :4], found[count, 4] = place, 0.0
                count += 1
    return count


@kernel
def _direction(x, y, end, step):
    """Unit vector along a straight wall to its end, by the beams end - step, end - 2 step, ...; nan
    if it is short or bent."""
    far, k = -1, end - step
    while 0 <= k < len(x):
        square = (x[k] - x[end]) ** 2 + (y[k] - y[end]) ** 2
        if square > MAX_ROW**2:
            break
        if square > MIN_ROW**2:
            far = k
        k -= step
    if far < 0:
        return np.nan, np.nan
    length = np.hypot(x[end] - x[far], y[end] - y[far])
    ux, uy = (x[end] - x[far]) / length, (y[end] - y[far]) / length
    for k in range(min(end, far), max(end, far) + 1):
        if abs((x[k] - x[far]) * uy - (y[k] - y[far]) * ux) > ROW_TOLERANCE:
            return np.nan, np.nan
    return ux, uy


@kernel
def _goes_on(x, y, end, after, ux, uy):
    """Whether the wall goes on to the echo `after` its supposed end."""
    dx, dy = x[after] - x[end], y[after] - y[end]
    return abs(dx * uy - dy * ux) < ROW_TOLERANCE and dx * ux + dy * uy < MIN_WIDTH


@kernel
def _leaf(echoes: Echoes, end, step, ux, uy):
    """m from the wall's end to a leaf square to the wall, along it; nan if there is none."""
    x, y, angles = echoes.x, echoes.y, echoes.angles
    total, squares, count, seen = 0.0, 0.0, 0, 0.0
    last, k = aside(echoes.ranges[end], angles[-1] - angles[0]), end + step
    while 0 <= k < len(x) and abs(angles[k] - angles[end]) < last:
        dx, dy = x[k] - x[end], y[k] - y[end]
        along, deep = dx * ux + dy * uy, abs(dx * uy - dy * ux)
        beside = MIN_WIDTH - HALF_LEAF < along < MAX_WIDTH + 2 * HALF_LEAF
        if beside and MIN_DEPTH < deep < along + OVERHANG:
            total, squares, count = total + along, squares + along * along, count + 1
            seen = max(seen, deep)
        k += step
    if count < MIN_ECHOES:
        return np.nan
    mean = total / count
    spread = np.sqrt(max(squares / count - mean * mean, 0.0))
    return mean if spread < MAX_SPREAD and seen > MIN_SEEN * mean else np.nan
