"""How much of what one scan saw the next one contradicts.

A place changes piece by piece: a door, a person. A robot that was carried sees all of it change
from one scan to the next, even where the other place looks much the same.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.scan import Scan

MARGIN = 0.25  # m by which an echo must lie before what the other scan saw in its direction
NEIGHBOURS = 2  # beams to each side, all of which must have seen farther
MIN_POINTS = 10  # that both scans can see; fewer tell nothing


class Sight(NamedTuple):
    """What a scan saw; poses are those of the sensor.

    points  (n, 2) m, its echoes in the robot's frame
    angles  (beams,) rad, ascending
    free    (beams,) m, that is free in each direction and NEIGHBOURS to each side
    mount   pose of the sensor on the robot
    """

    points: Array
    angles: Array
    free: Array
    mount: Pose2


def sight(scan: Scan) -> Sight:
    """What the scan saw."""
    free = _free(scan.ranges, scan.hit, scan.no_echo, scan.max_range)
    order = -1 if len(free) > 1 and scan.angles[-1] < scan.angles[0] else 1
    angles, free = scan.angles[::order], free[::order]
    return Sight(scan.points, np.ascontiguousarray(angles), np.ascontiguousarray(free), scan.mount)


def change(before: Sight, after: Sight, displacement: Pose2) -> float:
    """Share of the echoes of two scans, between which the robot moved by `displacement`, that lie
    where the other scan saw free space; from 0 to 2, the sum of both directions."""
    return _share(before, after, displacement) + _share(after, before, displacement.inverse())


def _share(seen: Sight, other: Sight, displacement: Pose2) -> float:
    """Share of the echoes of `other` in the free space of `seen`, `displacement` before."""
    sensor = seen.mount.inverse() @ displacement
    free, known = _counts(seen.angles, seen.free, other.points, sensor.x, sensor.y, sensor.theta)
    return free / known if known >= MIN_POINTS else 0.0


@kernel
def _free(ranges, hit, no_echo, max_range):
    """(beams,) the least free range among each beam and its neighbours."""
    result = np.zeros(len(ranges))
    for k in range(NEIGHBOURS, len(ranges) - NEIGHBOURS):
        nearest = np.inf
        for m in range(k - NEIGHBOURS, k + NEIGHBOURS + 1):
            length = ranges[m] if hit[m] else 0.0
            nearest = min(nearest, max_range if no_echo[m] else length)
        result[k] = nearest
    return result


@kernel
def _counts(angles, free, points, x, y, theta):
    """Numbers of points in free space, and of those in view; `angles` ascend."""
    c, s = np.cos(theta), np.sin(theta)
    inside = known = place = 0
    for k in range(len(points)):
        px, py = x + c * points[k, 0] - s * points[k, 1], y + s * points[k, 0] + c * points[k, 1]
        place = _following(angles, np.arctan2(py, px), place)
        if NEIGHBOURS <= place < len(angles) - NEIGHBOURS:
            known += 1
            inside += np.sqrt(px * px + py * py) < free[place] - MARGIN
    return inside, known


@kernel
def _following(angles, angle, place):
    """The place of the first of ascending angles that is not less than `angle`, sought from a
    place near to it: neighbouring echoes lie in neighbouring beams."""
    while place > 0 and angles[place - 1] >= angle:
        place -= 1
    while place < len(angles) and angles[place] < angle:
        place += 1
    return place
