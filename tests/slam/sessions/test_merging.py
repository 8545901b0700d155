"""Two sessions of parts of a building that overlap: found, tied, bent; or refused where unsure."""

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from slam.errors import InputError
from slam.forecast.door import DoorForecast
from slam.geometry import Pose2, between, compose
from slam.io.door_memory import RememberedDoor
from slam.layers.doors import MappedDoor
from slam.maps.clamped import Clamped
from slam.recovery.places import at
from slam.sessions.merging import merged
from slam.sessions.placing import told
from slam.sessions.relocalisation import drawn
from slam.sessions.session import Session
from slam.sessions.stretches import stretches
from tests.slam.worlds import scan_at

ANGLES = np.radians(np.arange(-180, 180, 4.0))
OUTER = [(0, 0), (6, 0), (6, -2), (7, -2), (7, 0), (16, 0), (16, 3), (19, 3), (19, 5), (16, 5)]
OUTER += [(16, 12), (13, 15), (10, 12), (9, 12), (9, 13), (7, 13), (7, 12), (0, 12), (0, 8)]
OUTER += [(-2, 8), (-2, 6), (0, 6)]
INNER = [(3, 3), (5, 4), (9, 3), (9, 5), (10, 5), (10, 3), (13, 3), (12, 6), (13, 9), (6, 9)]
INNER += [(6, 7), (3, 7)]
DISTINCT = np.array(
    [[*a, *b] for line in (OUTER, INNER) for a, b in pairwise([*line, line[0]])], dtype=float
)
"""A ring of corridors, each with other niches and corners."""
SQUARE = [(0, 0), (16, 0), (16, 16), (0, 16)], [(3, 3), (13, 3), (13, 13), (3, 13)]
ALIKE = np.array([[*a, *b] for line in SQUARE for a, b in pairwise([*line, line[0]])], dtype=float)
"""A ring that looks the same from all four sides."""
ELSEWHERE = Pose2(-40.0, 25.0, 2.0)  # the first map's frame in that of the other one


def around(height: float) -> np.ndarray:
    """(n, 3) poses once and a half round the ring, 0.25 m apart."""
    corners = [(1.5, 1.5), (14.5, 1.5), (14.5, height), (1.5, height)]
    rows = []
    for a, b in pairwise([*corners, *corners[:3]]):
        n = round(4.0 * math.dist(a, b))
        heading = math.atan2(b[1] - a[1], b[0] - a[0])
        rows += [(*(a + (np.array(b) - a) * k / n), heading) for k in range(n)]
    return np.array(rows)


LATER = 1000.0  # s: the other session is a recording of its own


@cache
def drive(alike: bool) -> Session:
    """At its true poses."""
    walls, height = (ALIKE, 14.5) if alike else (DISTINCT, 10.5)
    rng, poses = np.random.default_rng(3), around(height)
    scans = [scan_at(Pose2.of(p), 0.5 * k, ANGLES, walls, rng=rng) for k, p in enumerate(poses)]
    return Session(tuple(scans), poses)


def part(whole: Session, begin: int, end: int, later: float = 0.0) -> Session:
    chosen = np.zeros(len(whole.scans), np.bool_)
    chosen[begin:end] = True
    found = whole.kept(chosen)
    return replace(found, scans=tuple(replace(s, time=s.time + later) for s in found.scans))


def bent(session: Session, per_step: float = 2e-4) -> Session:
    """The session in a frame of its own, with a heading that drifts by rad at each scan."""
    poses = [np.array(ELSEWHERE)]
    for step in between(session.poses[:-1], session.poses[1:]):
        poses.append(compose(poses[-1], compose(step, (0.0, 0.0, per_step))))
    return replace(session, poses=np.array(poses))


def door(x: float, y: float, until: float) -> RememberedDoor:
    one = MappedDoor(np.array([[x, y], [x + 0.9, y]]), 0.5, 1, 9.0, 0, 9, 9, 9, 0.95)
    return RememberedDoor(one, DoorForecast(), until)


def test_the_other_map_is_found_tied_and_bent_while_the_first_one_stays() -> None:
    whole = drive(alike=False)
    first, other = part(whole, 0, 140), bent(part(whole, 60, 250, LATER))
    result = merged(first, other)
    np.testing.assert_array_equal(result.session.poses[:140], first.poses)
    rigid = compose(result.place, other.poses)
    truth = whole.poses[60:250]
    off = np.hypot(*(result.session.poses[140:] - truth)[:, :2].T)
    assert np.median(off[:80]) < 0.03  # what both saw
    assert off.max() < 0.15  # 0.21 where neighbours are trusted to 2 cm and 0.3 degrees
    assert np.median(np.hypot(*(rigid - truth)[:, :2].T)) > 1.5 * np.median(off)
    assert result.shown >= 3 + 2 * result.rival
    assert 0.05 < result.bent < 1.0


def test_where_the_map_looks_alike_from_several_sides_the_places_are_named() -> None:
    whole = drive(alike=True)
    first, other = part(whole, 0, 160), part(whole, 60, 260, LATER)
    with pytest.raises(InputError, match=r"several places: .* --at .* or --at "):
        merged(first, other)
    given = merged(first, other, Pose2(0.1, -0.1, 0.03))
    off = between(whole.poses[60:260], given.session.poses[160:])
    np.testing.assert_allclose(off, 0.0, atol=0.05)


def test_maps_that_do_not_overlap_are_refused() -> None:
    whole = drive(alike=False)
    with pytest.raises(InputError, match="do not overlap enough: of 3 stretches"):
        merged(part(whole, 0, 60), part(whole, 110, 170))
    with pytest.raises(InputError, match="do not overlap enough"):
        merged(part(whole, 0, 60), part(whole, 0, 60, LATER), Pose2(30.0, 30.0))


def test_a_stretch_that_was_seen_through_walls_is_contradicted() -> None:
    first = part(drive(alike=False), 0, 100)
    reading = drawn(first, Clamped())
    parts = list(stretches(first))
    assert len(parts) > 3
    for one in parts:
        here = at(reading, one.scan, one.pose)
        assert told(reading, one, here) == 1
        through = one._replace(scan=replace(one.scan, seen=-one.scan.seen))
        assert told(reading, through, here) == -1
    nowhere = at(reading, parts[0].scan, Pose2(90.0, 90.0))
    assert told(reading, parts[0], nowhere) == 0


def test_doors_move_with_their_map_to_where_they_were_mapped_last() -> None:
    whole = drive(alike=False)
    there = ELSEWHERE @ Pose2.of(whole.poses[60]).inverse()

    def seen_from_there(x: float, y: float, until: float) -> RememberedDoor:
        one = door(x, y, until)
        ends = compose(there, np.column_stack([one.door.ends, np.zeros(2)]))[:, :2]
        return one._replace(door=one.door._replace(ends=ends))

    first = replace(part(whole, 0, 140), doors=(door(4.0, 3.0, 5.0), door(7.0, 0.0, 5.0)))
    others = seen_from_there(4.1, 3.0, 9.0), seen_from_there(7.0, 9.0, 9.0)
    other = replace(bent(part(whole, 60, 250), 0.0), doors=others)
    found = merged(first, other).session.doors
    assert [one.until for one in found] == [9.0, 5.0, 9.0]
    middles = [one.door.ends.mean(axis=0) for one in found]
    np.testing.assert_allclose(middles, [(4.55, 3.0), (7.45, 0.0), (7.45, 9.0)], atol=0.05)


def test_recordings_of_unix_time_follow_each_other() -> None:
    whole = drive(alike=False)
    later, earlier = part(whole, 0, 140, 1.8e9), part(whole, 60, 250, 1.7e9)
    both = merged(later, earlier).session
    assert both.recordings.tolist() == [0] * 190 + [1] * 140
    assert (np.diff(both.times) > 0).all()


def test_a_scan_that_both_have_is_kept_once() -> None:
    whole = drive(alike=False)
    first = part(whole, 0, 140)
    both = merged(first, bent(part(whole, 60, 250))).session
    assert sorted(both.times.tolist()) == whole.times[:250].tolist()
    with pytest.raises(InputError, match="all its scans are in the first one already"):
        merged(first, part(whole, 60, 100))
