"""Doors by their shape: a gap or a recess of a door's width in a straight wall, with two jambs.

An open door is a gap, a closed one a recess, since a leaf hangs within the depth of its wall. Both
are recognised in a single scan, before the door has moved.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dynslam_env.patrol.open_leaf import open_leaf
from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.scan import Scan

MIN_WIDTH, MAX_WIDTH = 0.75, 0.97  # m between jambs
MAX_SPACING = 0.3  # m from an echo on a wall to the next, beside a gap
LEAST_SQUARE = 0.99 * MIN_WIDTH**2  # m^2: beyond these two, no hypotenuse is needed
MOST_SQUARE = 1.01 * (MAX_WIDTH + 2.0 * MAX_SPACING) ** 2
WALL_TOLERANCE, WALL_SLOPE = 0.02, 0.05  # of a wall's echoes from its line: m, and per m from it
WALL_REACH, MIN_WALL = 0.35, 0.18  # m, checked on each side of the gap; least wall found there
MIN_RECESS = 0.04  # m, of a closed leaf behind the wall's face
JAMB_MARGIN = 0.1  # m beside a jamb in which its own side shows
MIN_BEAMS = 4  # between the jambs
MAX_DISTANCE = 7.0  # m of the jambs from the sensor
MAX_RECESS = 0.2  # m: farther behind the wall's face there is no closed leaf

MIN_INCIDENCE = 0.2  # sine of the angle between beam and wall: flatter beams are not used
LEAF_TOLERANCE = 0.16  # m of an echo from the wall's middle line that may be the closed leaf's
JAMB_SIDE = 0.06  # m beside a jamb, where echoes may be of its side
INNER_SHARE = 0.75  # of the width of a doorway in which beams count


def suspects(scan: Scan, pose: Pose2) -> Array:
    """(n, 5) x, y of the middle, m; direction of the wall, rad; width, m; 1 if a leaf closes it.
    Each row is a gap or recess in one wall."""
    sensor, beams = _beams(scan, pose)
    return _suspects(scan.ranges, scan.angles, beams, sensor, min(scan.max_range, 1e6))


def looked(scan: Scan, pose: Pose2, places: Array) -> NDArray[np.int64]:
    """(d, 4) of each doorway of `places` (d, 4), x, y, direction, width, m and rad: beams that
    reached it, how many of them ended at it, and 1 if a leaf that stands open is seen, and if one
    seems to stand towards the sensor; see `open_leaf`."""
    sensor, beams = _beams(scan, pose)
    return _looked(scan.ranges, beams, sensor, scan.max_range, places)


def _beams(scan: Scan, pose: Pose2) -> tuple[Array, Array]:
    """(3,) the sensor's pose, and (2, n) cosines and sines of the beams' bearings."""
    sensor = np.array(pose @ scan.mount)
    return sensor, _directions(scan.angles + sensor[2])


@kernel
def _directions(bearings):
    found = np.empty((2, len(bearings)))
    for k in range(len(bearings)):
        found[0, k], found[1, k] = np.cos(bearings[k]), np.sin(bearings[k])
    return found


@kernel
def _suspects(ranges, angles, beams, sensor, longest):
    n = len(ranges)
    x, y = np.empty(n), np.empty(n)
    for k in range(n):
        away = ranges[k] if ranges[k] > 0.0 else np.nan
        if away > 2.0 * longest:  # no echo
            away = 2.0 * longest
        x[k] = sensor[0] + away * beams[0, k]
        y[k] = sensor[1] + away * beams[1, k]
    spacing = np.full(n, np.inf)  # from the beam before
    for k in range(1, n):
        spacing[k] = np.hypot(x[k] - x[k - 1], y[k] - y[k - 1])
    found = np.empty((n, 5))
    count = 0
    i = 1
    while i < n - MIN_BEAMS - 2:
        step, before = 1, spacing[i]
        if ranges[i] < MAX_DISTANCE and before < MAX_SPACING and count < n:
            last = angles[i] + _aside(ranges[i], angles[-1] - angles[0])
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
                closed = _between(x, y, i, j, width)
                if closed < 0 or not _walls(x, y, i, j, width):
                    continue
                found[count, 0], found[count, 1] = (x[i] + x[j]) / 2, (y[i] + y[j]) / 2
                found[count, 2] = np.arctan2(y[j] - y[i], x[j] - x[i])
                found[count, 3] = width - (before + after) / 2.0
                found[count, 4] = closed
                count += 1
                step = j - i
                break
        i += step
    return found[:count]


@kernel
def _aside(away, view):
    """rad, from a beam whose echo is `away` m: beams farther aside pass the echo at more than the
    width of a doorway. Infinite if no beam does, or the field of view `view`, rad, comes round."""
    if away * away <= MOST_SQUARE:
        return np.inf
    angle = np.arcsin(np.sqrt(MOST_SQUARE) / away)
    return angle if view < 2.0 * np.pi - angle else np.inf


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


@kernel
def _looked(ranges, beams, sensor, longest, places):
    found = np.empty((len(places), 4), np.int64)
    for d in range(len(places)):
        found[d] = _looked_at(ranges, beams, sensor, longest, places[d])
    return found


@kernel
def _looked_at(ranges, beams, sensor, longest, place):
    """Only the inner part of the doorway counts; beams that ended before it do not."""
    ux, uy = np.cos(place[2]), np.sin(place[2])
    dx, dy = place[0] - sensor[0], place[1] - sensor[1]
    half, side, ahead = place[3] / 2, dx * uy - dy * ux, dx * ux + dy * uy
    reached, ended = 0, 0
    for k in range(len(ranges)):
        bx, by = beams[0, k], beams[1, k]
        across = bx * uy - by * ux
        if not ranges[k] > 0.0 or abs(across) < MIN_INCIDENCE:
            continue
        away = side / across
        if away < 0.0 or away > longest - LEAF_TOLERANCE / abs(across):
            continue
        if abs(away * (bx * ux + by * uy) - ahead) > INNER_SHARE * half:
            continue
        behind = (min(ranges[k], longest) - away) * abs(across)
        ends = ranges[k] * (bx * ux + by * uy) - ahead
        if behind < LEAF_TOLERANCE and abs(ends) > half - JAMB_SIDE:
            continue  # it may have met the side of a jamb
        if behind > -LEAF_TOLERANCE:
            reached += 1
            ended += behind < LEAF_TOLERANCE
    leaf, towards = open_leaf(ranges, beams, longest, (ahead, side, half, ux, uy))
    return reached, ended, leaf, towards
