"""How much of what one scan saw the next ones contradict, and how much of it they see again.

A place changes piece by piece: a door, a person. A robot that was carried sees all of it change
from one scan to the next, even where the other place looks much the same. None of this depends on
the map.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.recovery.match import Match
from slam.scan import Scan

ONE_SIDED = 0.005  # share of the echoes, at most, that changed in the other direction
MARGIN = 0.25  # m by which an echo must lie before what the other scan saw in its direction
NEIGHBOURS = 2  # beams to each side, all of which must have seen farther
MIN_POINTS = 10  # that both scans can see; fewer tell nothing
NEAR = 0.1  # m from the outline of the other scan, at most, of an echo of the same surface
MAX_GAP = 0.5  # m between neighbouring echoes of one surface
WIDER = 1.6  # than NEAR at the distance of an echo, to both sides: the angle that is looked through
RECENT = 5  # keyframes, after one of which the odometry may have failed unnoticed
HEADINGS = np.radians(sorted(range(-60, 61, 2), key=abs))  # rad, by which a match may be wrong
FRAME = 9  # numbers that tell where a scan was taken, see `_overlaps`


class Sight(NamedTuple):
    """What a scan saw.

    pieces  (n, 2) m, the surfaces, in the robot's frame: see `Scan.pieces`
    angles  (beams,) rad, ascending
    free    (beams,) m, that is free in each direction and NEIGHBOURS to each side
    robot   its pose from the sensor
    """

    pieces: Array
    angles: Array
    free: Array
    robot: Pose2


class Recent:
    """What the last keyframes saw, as far as each sees much the same as the one before."""

    def __init__(self) -> None:
        self._last: Sight | None = None  # of the last keyframe
        self._latest: tuple[Scan, Sight] | None = None
        self._number, self._newest = 0, -1  # of the keyframes, and the row of the last one, in:
        self._outlines = np.empty((RECENT, 0, 2))
        self._bearings = np.empty((RECENT, 0))
        self._frames = np.empty((RECENT, FRAME))

    def clear(self) -> None:
        """Forget the keyframes: the next one is taken elsewhere."""
        self._last, self._number = None, 0

    def add(self, match: Match) -> float:
        """Add a keyframe; returns the change of the scan since the one before, 0 if that is not
        known."""
        if not match.continuous:
            self.clear()
        step = match.last.between(match.estimate.pose)
        changed = self.change(match.scan, step)
        self._last = self._sight(match.scan)
        self._keep(match.scan, self._last.robot, step)
        return changed

    def _keep(self, scan: Scan, robot: Pose2, step: Pose2) -> None:
        """Write a scan, `step` after the one before, to the rows that `_overlaps` reads: its echoes
        in the sensor's frame, in which the `robot` stands, by ascending angle."""
        echoes = len(scan.points)
        if echoes > self._bearings.shape[1]:
            more = echoes - self._bearings.shape[1]
            self._outlines = np.pad(self._outlines, ((0, 0), (0, more), (0, 0)))
            self._bearings = np.pad(self._bearings, ((0, 0), (0, more)))
        row = self._newest = (self._newest + 1) % RECENT
        self._number = min(self._number + 1, RECENT)
        angles = scan.angles.copy()  # writable: kernels are compiled for one kind
        first, last = _write(scan.points, angles, scan.hit, robot, self._outlines[row],
                             self._bearings[row])  # fmt: skip
        self._frames[row] = echoes, first, last, *robot, *step

    def change(self, scan: Scan, displacement: Pose2) -> float:
        """The change of a scan since the last keyframe, `displacement` before; 0 if not known."""
        return 0.0 if self._last is None else change(self._last, self._sight(scan), displacement)

    def overlaps(self, match: Match, pose: Pose2, most: int = RECENT) -> Array:
        """(k, 2) overlap of each of the last scans, the latest first and at most so many, with the
        scan of a match, if it was taken at `pose`; and the number of its echoes in view."""
        pieces, away = match.scan.pieces, match.last.between(pose)
        return _overlaps(
            self._outlines, self._bearings, self._frames, self._newest, min(self._number, most),
            pieces, *away,
        )  # fmt: skip

    def as_seen_last(self, match: Match) -> Pose2:
        """The pose of a match, turned so that the latest scan saw most of the same; by the least
        of equal turns."""
        poses = [match.estimate.pose @ Pose2(0.0, 0.0, turn) for turn in HEADINGS]
        return max(poses, key=lambda pose: round(self.overlaps(match, pose, 1).prod()))

    def _sight(self, scan: Scan) -> Sight:
        """What the scan saw; that of a keyframe is needed up to three times."""
        if self._latest is None or self._latest[0] is not scan:
            self._latest = scan, sight(scan)
        return self._latest[1]


def sight(scan: Scan) -> Sight:
    """What the scan saw."""
    pieces, angles = scan.pieces, scan.angles.copy()  # writable: see `Recent._keep`
    angles, free = _ascending(angles, scan.ranges, scan.hit, scan.no_echo, scan.max_range)
    return Sight(pieces, angles, free, scan.mount.inverse())


def change(before: Sight, after: Sight, displacement: Pose2) -> float:
    """Share of the echoes of two scans, between which the robot moved by `displacement`, that lie
    where the other scan saw free space; from 0 to 2, the sum of both directions. 0 if it is of one
    direction only: something came, or went, and the robot is where it was."""
    came = _share(before, after, displacement)
    if came <= ONE_SIDED:
        return 0.0
    went = _share(after, before, displacement.inverse())
    return came + went if went > ONE_SIDED else 0.0


def _share(seen: Sight, other: Sight, displacement: Pose2) -> float:
    """Share of the echoes of `other` in the free space of `seen`, `displacement` before."""
    free, known = _counts(seen.angles, seen.free, other.pieces, *(seen.robot @ displacement))
    return free / known if known >= MIN_POINTS else 0.0


@kernel
def _ascending(angles, ranges, hit, no_echo, max_range):
    """The angles of the beams, and what is free there, by ascending angle."""
    free, step = _free(ranges, hit, no_echo, max_range), -1 if _descend(angles) else 1
    return angles[::step].copy(), free[::step].copy()


@kernel
def _descend(angles):
    return len(angles) > 1 and angles[-1] < angles[0]


@kernel
def _write(points, angles, hit, robot, outline, bearings):
    """Write echoes (n, 2), in the robot's frame, to `outline` in the sensor's, and their angles to
    `bearings`, by ascending angle; returns the first and the last angle of the beams.

    angles, hit  (beams,) rad, and whether there is an echo
    robot        its pose from the sensor
    """
    c, s, n = np.cos(robot[2]), np.sin(robot[2]), 0
    beams, down = len(angles), _descend(angles)
    for k in range(beams):
        beam = beams - 1 - k if down else k
        if hit[beam]:
            echo = len(points) - 1 - n if down else n
            x, y = points[echo, 0], points[echo, 1]
            outline[n, 0] = c * x - s * y + robot[0]
            outline[n, 1] = s * x + c * y + robot[1]
            bearings[n] = angles[beam]
            n += 1
    if not beams:
        return 0.0, 0.0
    return (angles[-1], angles[0]) if down else (angles[0], angles[-1])


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
        place = _following(angles, _from(angles[0], math.atan2(py, px)), place)
        if NEIGHBOURS <= place < len(angles) - NEIGHBOURS:
            known += 1
            inside += np.sqrt(px * px + py * py) < free[place] - MARGIN
    return inside, known


@kernel
def _from(first, angle):
    """The angle that is at least `first`: lasers count from -pi or from 0."""
    return angle if angle >= first else angle + 2.0 * math.pi


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
def _overlaps(outlines, bearings, frames, newest, number, points, x, y, theta):
    """See `Recent.overlaps`: of the last `number` rows up to the newest one.

    frames    (RECENT, FRAME) of each scan: its echoes in `outlines` and `bearings`, first and last
              angle, the robot's pose from its sensor, its pose from the scan before
    x, ...    pose of the points from the newest scan
    """
    result, away = np.empty((number, 2)), (x, y, theta)
    for k in range(number):
        row = (newest - k) % len(frames)
        frame = frames[row]
        echoes, view = int(frame[0]), (frame[1], frame[2])
        sensor = _after((frame[3], frame[4], frame[5]), away)
        near, known = _near(outlines[row, :echoes], bearings[row, :echoes], view, points, *sensor)
        result[k, 0] = near / known if known >= MIN_POINTS else 0.0
        result[k, 1] = known
        away = _after((frame[6], frame[7], frame[8]), away)
    return result


@kernel
def _after(one, other):
    """The pose `other`, given in the frame of `one`."""
    c, s = np.cos(one[2]), np.sin(one[2])
    x, y = one[0] + c * other[0] - s * other[1], one[1] + s * other[0] + c * other[1]
    return x, y, one[2] + other[2]


@kernel
def _near(outline, bearings, view, points, x0, y0, theta):
    """Numbers of the points, moved by a pose, within NEAR of the line along an outline at ascending
    `bearings`, and of all in view: at angles from view[0] to view[1]."""
    c, s = np.cos(theta), np.sin(theta)
    number = known = place = 0
    for k in range(len(points)):
        x = x0 + c * points[k, 0] - s * points[k, 1]
        y = y0 + s * points[k, 0] + c * points[k, 1]
        angle = _from(view[0], math.atan2(y, x))
        if angle > view[1]:
            continue
        known += 1
        place = _following(bearings, angle, place)
        if 0 < place < len(outline) and _close(outline, place - 1, x, y):
            number += 1  # as most points: on the surface that lies in their own direction
            continue
        width = NEAR / max(math.sqrt(x * x + y * y), NEAR) * WIDER
        for m in range(max(_following(bearings, angle - width, place) - 1, 0), len(outline) - 1):
            if _close(outline, m, x, y):
                number += 1
                break
            if bearings[m] > angle + width:
                break
    return number, known


@kernel
def _close(outline, m, x, y):
    """Whether a point lies within NEAR of the line from echo `m` of an outline to the next, or of
    that echo if they are not of one surface."""
    first_x, first_y = outline[m, 0], outline[m, 1]
    along_x, along_y = outline[m + 1, 0] - first_x, outline[m + 1, 1] - first_y
    square = along_x * along_x + along_y * along_y
    x, y = x - first_x, y - first_y
    if 0.0 < square < MAX_GAP * MAX_GAP:
        place = min(max((x * along_x + y * along_y) / square, 0.0), 1.0)
        x, y = x - place * along_x, y - place * along_y
    return x * x + y * y < NEAR * NEAR
