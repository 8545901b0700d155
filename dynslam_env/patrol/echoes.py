"""Echoes: a scan as points in the plane, for the search for doorways."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.scan import Scan

MIN_WIDTH, MAX_WIDTH = 0.75, 0.97  # m between jambs
MAX_SPACING = 0.3  # m from an echo on a wall to the next, beside a gap
MOST_SQUARE = 1.01 * (MAX_WIDTH + 2.0 * MAX_SPACING) ** 2  # m^2, from jamb to jamb at most
MIN_BEAMS = 4  # between the jambs
MAX_DISTANCE = 7.0  # m of the jambs from the sensor
SAME = 0.4  # m between the middles of one doorway found twice in a scan


class Echoes(NamedTuple):
    """n beams of a scan, whose bearings must rise.

    x, y     (n,) m; nan without a reading; without an echo at most 2 longest away
    spacing  (n,) m, from the beam before; inf for the first
    ranges   (n,) m
    angles   (n,) rad, from the sensor's heading
    beams    (2, n) cosines and sines of the bearings
    sensor   (3,) pose
    longest  m that the sensor measures
    """

    x: Array
    y: Array
    spacing: Array
    ranges: Array
    angles: Array
    beams: Array
    sensor: Array
    longest: float


def beams_of(scan: Scan, pose: Pose2) -> tuple[Array, Array]:
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
def echoes_of(ranges, angles, beams, sensor, longest):
    """The echoes of a scan; the arguments as in `Echoes`."""
    n = len(ranges)
    x, y, spacing = np.empty(n), np.empty(n), np.full(n, np.inf)
    for k in range(n):
        away = ranges[k] if ranges[k] > 0.0 else np.nan
        if away > 2.0 * longest:  # no echo
            away = 2.0 * longest
        x[k] = sensor[0] + away * beams[0, k]
        y[k] = sensor[1] + away * beams[1, k]
        if k:
            spacing[k] = np.hypot(x[k] - x[k - 1], y[k] - y[k - 1])
    return Echoes(x, y, spacing, ranges, angles, beams, sensor, longest)


@kernel
def aside(away, view):
    """rad, from a beam whose echo is `away` m: beams farther aside pass the echo at more than the
    widest doorway with the spacing at its jambs. Infinite if no beam does, or the field of view
    `view`, rad, comes round."""
    if away * away <= MOST_SQUARE:
        return np.inf
    angle = np.arcsin(np.sqrt(MOST_SQUARE) / away)
    return angle if view < 2.0 * np.pi - angle else np.inf


@kernel
def is_new(found, count, x, y):
    """Whether a doorway with this middle, m, is none of the first `count` rows of `found` (n, 5),
    which are those of `suspects`, and there is room for it."""
    for k in range(min(count, len(found))):
        if np.hypot(found[k, 0] - x, found[k, 1] - y) < SAME:
            return False
    return count < len(found)
