"""How much of what one scan saw the next one contradicts.

A place changes piece by piece: a door, a person. A robot that was carried sees all of it change
from one scan to the next, even where the other place looks much the same.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, transform_points
from slam.kernel import kernel
from slam.recovery.match import Match
from slam.scan import Scan

MARGIN = 0.25  # m by which an echo must lie before what the other scan saw in its direction
NEIGHBOURS = 2  # beams to each side, all of which must have seen farther
MIN_POINTS = 10  # that both scans can see; fewer tell nothing
NEAR = 0.1  # m from the outline of the other scan, at most, of an echo of the same surface
MAX_GAP = 0.5  # m between neighbouring echoes of one surface
FEW = 200  # echoes that are compared
ECHO_EVIDENCE = 0.5  # nats of an echo that lies on a surface that the scan before saw
LESS_OVERLAP = 0.15  # by which an earlier scan agrees less than the last one, at most
RECENT = 5  # keyframes, after one of which the odometry may have failed unnoticed


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


class Recent:
    """What the last keyframes saw, as far as each sees much the same as the one before."""

    def __init__(self) -> None:
        self._sights: deque[Sight] = deque(maxlen=RECENT)
        self._steps: deque[Pose2] = deque(maxlen=RECENT)  # to each of them from the one before

    def clear(self) -> None:
        """Forget the keyframes: the next one is taken elsewhere."""
        self._sights.clear()
        self._steps.clear()

    def add(self, match: Match) -> float:
        """Add a keyframe; returns the change of the scan since the one before, 0 if that is not
        known."""
        if not match.continuous:
            self.clear()
        seen, step = sight(match.scan), match.last.between(match.estimate.pose)
        changed = change(self._sights[-1], seen, step) if self._sights else 0.0
        self._sights.append(seen)
        self._steps.append(step)
        return changed

    def evidence(self, match: Match, pose: Pose2) -> float:
        """Log-likelihood ratio, nats, of the last scans: for a scan at `pose`, against the pose of
        its match. If the odometry failed after one of them, that one agrees better with the scan at
        `pose`. This does not depend on the map, in which a room may look like itself turned."""
        if len(self._sights) < RECENT:
            return 0.0
        seen, away = sight(match.scan), match.last.between(match.estimate.pose)
        correction = match.estimate.pose.between(pose)
        gain = -1.0
        least = overlap(self._sights[-1], seen, away) - LESS_OVERLAP
        for before, step in zip(reversed(self._sights), reversed(self._steps), strict=True):
            corrected = overlap(before, seen, away @ correction)
            if corrected > least:
                gain = max(gain, corrected - overlap(before, seen, away))
            away = step @ away
        return ECHO_EVIDENCE * len(match.scan.points) * gain


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


def overlap(before: Sight, after: Sight, displacement: Pose2) -> float:
    """Share of the echoes of the second scan, as far as they are in the view of the first, that lie
    on surfaces of the first, if the robot moved by `displacement` between them."""
    points = after.points[:: max(len(after.points) // FEW, 1)]
    mount = before.mount.inverse()
    agreeing, known = _near(
        transform_points(mount, before.points),
        before.angles[0],
        before.angles[-1],
        transform_points(mount @ displacement, points),
    )
    return agreeing / known if known >= MIN_POINTS else 0.0


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


@kernel
def _near(outline, first, last, points):
    """Number of points within NEAR of the line along an outline, in the order of its beams, and of
    all points in view: those at angles from `first` to `last`."""
    number = known = 0
    for k in range(len(points)):
        angle = math.atan2(points[k, 1], points[k, 0])
        if first <= angle <= last:
            known += 1
            number += _is_near(outline, points[k, 0], points[k, 1])
    return number, known


@kernel
def _is_near(outline, x, y):
    for k in range(len(outline) - 1):
        along_x, along_y = outline[k + 1, 0] - outline[k, 0], outline[k + 1, 1] - outline[k, 1]
        away_x, away_y = x - outline[k, 0], y - outline[k, 1]
        square = along_x * along_x + along_y * along_y
        place = 0.0
        if 0.0 < square < MAX_GAP * MAX_GAP:
            place = min(max((away_x * along_x + away_y * along_y) / square, 0.0), 1.0)
        away_x, away_y = away_x - place * along_x, away_y - place * along_y
        if away_x * away_x + away_y * away_y < NEAR * NEAR:
            return True
    return False
