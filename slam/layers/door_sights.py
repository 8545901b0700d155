"""When a door was seen open, and when closed, during a drive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, transform_points
from slam.layers.doors import LEAF_DEPTH, MappedDoor, in_gap
from slam.scan import Scan

MAX_SCANS, MAX_BEAMS = 10_000, 400  # that are looked at, evenly spread
REACH = 40.0  # m from the laser to a door, beyond which hardly a beam meets its leaf
EDGE = 0.15  # of the width at either end of a gap, where beams hit the jamb
MIN_BEAMS = 2  # of a sight
MAX_GAP = 3.0  # s without a sight, after which another one begins


class Sight(NamedTuple):
    """A time during which a door was seen in one state.

    begin, end  s from the first scan
    open        whether it was open
    """

    begin: float
    end: float
    open: bool


class Echoes(NamedTuple):
    """The echoes of a drive.

    times    (n,) s from the first scan
    sensors  (n, 2) positions of the laser, m, map frame
    scan     (m,) the number among the n of each echo
    points   (m, 2) m, map frame
    """

    times: Array
    sensors: Array
    scan: np.ndarray
    points: Array


def echoes(scans: Sequence[Scan], poses: Array) -> Echoes:
    """The echoes of scans at their poses (n, 3); of a long drive, of some of the scans."""
    chosen = np.unique(np.linspace(0, len(scans) - 1, MAX_SCANS).round().astype(int))
    points, sensors = [], []
    for number in chosen.tolist():
        scan, pose = scans[number], Pose2.of(poses[number])
        every = -(-max(len(scan.points), 1) // MAX_BEAMS)
        points.append(transform_points(pose, scan.points[::every]))
        sensors.append((pose @ scan.mount)[:2])
    times = np.array([scans[number].time for number in chosen.tolist()]) - scans[0].time
    counts = [len(one) for one in points]
    scan_of = np.repeat(np.arange(len(chosen)), counts)
    return Echoes(times, np.array(sensors), scan_of, np.concatenate(points))


def history(door: MappedDoor, seen: Echoes) -> list[Sight]:
    """The sights of a door, in the order of time.

    A scan sees it closed if beams end on the closed leaf, open if beams pass through the gap; if
    both, what more beams tell.
    """
    near = np.hypot(*(seen.sensors - door.ends.mean(axis=0)).T) < REACH
    beams = near[seen.scan]
    scan, count = seen.scan[beams], len(seen.times)
    along, across = in_gap(seen.points[beams], door.ends)
    from_along, from_across = (part[scan] for part in in_gap(seen.sensors, door.ends))
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = from_along + (along - from_along) * from_across / (from_across - across)
    low, high = EDGE * door.width, (1 - EDGE) * door.width
    before = np.abs(from_across) > LEAF_DEPTH
    on = before & (np.abs(across) < LEAF_DEPTH) & (along > low) & (along < high)
    through = before & (across * from_across < 0) & (np.abs(across) >= LEAF_DEPTH)
    through &= (crossing > low) & (crossing < high)
    closed, opened = (np.bincount(scan[which], minlength=count) for which in (on, through))
    told = closed != opened
    beams_of = np.maximum(closed, opened)[told]
    return _joined(seen.times[told], opened[told] > closed[told], beams_of)


def _joined(times: Array, opened: np.ndarray, beams: np.ndarray) -> list[Sight]:
    """Scans that follow each other in the same state as one sight, if it has MIN_BEAMS."""
    if not len(times):
        return []
    changes = (np.diff(times) > MAX_GAP) | (opened[1:] != opened[:-1])
    first = np.concatenate([[0], np.flatnonzero(changes) + 1])
    last = np.append(first[1:], len(times)) - 1
    return [
        Sight(float(times[a]), float(times[b]), bool(opened[a]))
        for a, b in zip(first, last, strict=True)
        if beams[a : b + 1].sum() >= MIN_BEAMS
    ]
