"""Sessions that add up: recordings, doors and their habits, places that are seen often, clocks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slam.episode import Episode
from slam.errors import InputError
from slam.forecast.door import DoorForecast
from slam.geometry import Pose2
from slam.io.door_memory import RememberedDoor
from slam.layers import layers
from slam.layers.doors import MappedDoor
from slam.scan import Scan
from slam.sessions.door_memory import FORGOTTEN, joined, remembered, with_remembered
from slam.sessions.pruning import NEWEST, pruned
from slam.sessions.session import Session, check_order
from slam.trajectory import Trajectory

MONDAY = 1767571200.0  # s, unix time
HOUR = 3600.0
DOOR = MappedDoor(np.array([[-0.45, 2.0], [0.45, 2.0]]), 0.5, 1, 9.0, 0, 9, 9, 9, 0.95)


def visit(begin: float, closed: bool, n: int = 30) -> list[Scan]:
    """A robot that stands before a wall with a door at (0, 2): scans each 0.1 s."""
    angles = np.linspace(-np.pi / 3, np.pi / 3, 121)
    wall = 2.0 / np.cos(angles)
    through = np.abs(2.0 * np.tan(angles)) < 0.45
    ranges = np.where(through & (not closed), 2.0 * wall, wall)
    mount = Pose2(0.0, 0.0, np.pi / 2)
    return [Scan(ranges, angles, 8.0, time=begin + 0.1 * k, mount=mount) for k in range(n)]


def session(*begins: tuple[float, bool]) -> Session:
    """Visits of a robot at the origin, at times, of an open or closed door."""
    made: Session | None = None
    for begin, closed in begins:
        scans, poses = visit(begin, closed), np.zeros((30, 3))
        made = Session(tuple(scans), poses) if made is None else made.followed_by(scans, poses)
    assert made is not None
    return made


def driven(*lines: np.ndarray) -> Session:
    """A session of recordings along paths (n, 3), a scan a pose."""
    made: Session | None = None
    for k, poses in enumerate(lines):
        scans = [Scan(np.ones(3), np.zeros(3), 8.0, time=100.0 * k + j) for j in range(len(poses))]
        made = Session(tuple(scans), poses) if made is None else made.followed_by(scans, poses)
    assert made is not None
    return made


def line(begin: float, end: float, heading: float = 0.0) -> np.ndarray:
    x = np.arange(begin, end, 0.25)
    return np.column_stack([x, np.zeros_like(x), np.full_like(x, heading)])


def test_recordings_and_doors_come_back(tmp_path: Path):
    known = session((MONDAY, True), (MONDAY + HOUR, False))
    known = replace(known, doors=remembered(known, [DOOR]))
    known.save(tmp_path / "a.npz")
    again = Session.load(tmp_path / "a.npz")
    assert again.recordings.tolist() == [0] * 30 + [1] * 30
    (door,), (before,) = again.doors, known.doors
    assert np.array_equal(door.door.ends, DOOR.ends)
    assert door.door[1:] == DOOR[1:]
    assert door.until == before.until == MONDAY + HOUR + 2.9
    later = MONDAY + np.array([0.5, 2.0]) * HOUR
    assert np.array_equal(door.forecast.ahead(later), before.forecast.ahead(later))


def test_recordings_of_old_files_are_told_by_their_clocks():
    scans = (*visit(0.0, True), *visit(0.0, True), *visit(50.0, True))
    assert np.bincount(Session(scans, np.zeros((90, 3))).recordings).tolist() == [30, 60]


@pytest.mark.parametrize("name", ["recordings", "doors", "doors_until", "door0_look"])
def test_a_damaged_session_is_refused(tmp_path: Path, name: str):
    known = session((MONDAY, True))
    replace(known, doors=remembered(known, [DOOR])).save(tmp_path / "a.npz")
    arrays = dict(np.load(tmp_path / "a.npz"))
    arrays[name] = np.full_like(arrays[name], np.nan, dtype=float)
    np.savez(tmp_path / "b.npz", **arrays)
    with pytest.raises(InputError, match=r"b\.npz"):
        Session.load(tmp_path / "b.npz")
    whole = (tmp_path / "a.npz").read_bytes()
    (tmp_path / "c.npz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"saved by dynslam \(its end is missing"):
        Session.load(tmp_path / "c.npz")


def test_a_door_is_learned_from_visit_to_visit():
    known = session((MONDAY + 9 * HOUR, False), (MONDAY + 20 * HOUR, True))
    (door,) = remembered(known, [DOOR])
    assert door.forecast.look is not None
    assert door.forecast.look[:2] == (MONDAY + 20 * HOUR + 2.9, 0)
    assert door.forecast.watched_hours.sum() > 0
    later = replace(known, doors=(door,)).followed_by(
        visit(MONDAY + 33 * HOUR, False), np.zeros((30, 3))
    )
    (again,) = remembered(later, [])  # it is not found now, and still known
    look = again.forecast.look
    assert look is not None
    assert look.state == 1
    assert door.forecast.look.state == 0  # the old one did not change
    nine, twenty = MONDAY + 7 * 24 * HOUR + np.array([9, 20]) * HOUR
    assert again.forecast.probability(nine) > again.forecast.probability(twenty)


def test_what_was_learned_is_not_learned_again():
    known = session((MONDAY + 9 * HOUR, False))
    (door,) = remembered(known, [DOOR])
    (again,) = remembered(replace(known, doors=(door,)), [DOOR])
    assert np.array_equal(again.forecast.week.watched, door.forecast.week.watched)


def test_recordings_without_a_date_teach_no_week():
    (door,) = remembered(session((0.0, True), (5.0, False)), [DOOR])
    assert door.forecast.look is None
    made = layers(visit(0.0, True), np.zeros((30, 3)))
    assert with_remembered(made, [door])[1] == [None]


def test_doors_are_found_again_nearby_and_forgotten_after_months():
    known = session((MONDAY, True))
    moved = DOOR._replace(ends=DOOR.ends + 0.1, open_share=0.9)
    far = DOOR._replace(ends=DOOR.ends + 3.0)
    turned = DOOR._replace(ends=np.array([[0.0, 1.55], [0.0, 2.45]]))
    unsure = far._replace(probability=0.3)
    doors = remembered(known, [DOOR])
    found = remembered(replace(known, doors=doors), [moved, far, turned, unsure])
    assert [one.door for one in found] == [moved, far, turned]
    old = RememberedDoor(DOOR, doors[0].forecast, doors[0].until + FORGOTTEN)
    assert remembered(replace(known, doors=(old,)), []) != ()
    older = old._replace(until=old.until + 10.0)
    assert remembered(replace(known, doors=(older,)), []) == ()


def test_habits_of_two_sessions_are_added_unless_a_recording_is_in_both():
    (first,) = remembered(session((MONDAY + 9 * HOUR, False)), [DOOR])
    (other,) = remembered(session((MONDAY + 33 * HOUR, True)), [DOOR._replace(open_share=0.1)])
    hours = first.forecast.watched_hours + other.forecast.watched_hours
    for pair in ((first, other), (other, first)):
        (both,) = joined(pair[:1], pair[1:], apart=True)
        assert np.array_equal(both.forecast.watched_hours, hours)
        assert (both.until, both.door.open_share) == (other.until, 0.1)
        (last,) = joined(pair[:1], pair[1:], apart=False)
        assert last is other
    assert first.forecast.watched_hours.sum() < hours.sum()  # it did not change


def test_doors_are_listed_most_probable_first_and_remembered_ones_with_their_week():
    known = session((MONDAY, True))
    others = DOOR._replace(probability=0.2), DOOR, DOOR._replace(probability=0.99)
    made = replace(layers(known.scans, known.poses), doors=others)
    memory = RememberedDoor(DOOR, DoorForecast.fit(MONDAY, MONDAY + HOUR, 1), MONDAY)
    listed, weeks = with_remembered(made, [memory])
    assert [door.probability for door in listed.doors] == [0.99, 0.95, 0.2]
    assert (weeks[0], weeks[2]) == (None, None)
    assert weeks[1] is not None
    assert weeks[1]["watched_hours"][0][0] == 1.0


def test_places_that_are_seen_often_keep_the_first_and_the_last_recordings():
    same = [line(0.0, 10.0)] * 9
    kept = pruned(driven(*same))
    assert np.unique(kept.recordings).tolist() == [0, *range(9 - NEWEST, 9)]
    assert np.array_equal(pruned(kept).recordings, kept.recordings)


def test_what_only_old_recordings_show_stays():
    far, back = line(0.0, 20.0), line(0.0, 10.0, np.pi)
    kept = pruned(driven(far, far, back, *[line(0.0, 10.0)] * 8))
    second = kept.poses[kept.recordings == 1]
    assert second[:, 0].min() > 10.5  # of the second, what no later one shows
    assert (kept.recordings == 2).sum() == len(back)  # in the other direction


def test_a_session_is_bounded_by_the_building():
    rng, known, counts = np.random.default_rng(0), driven(line(0.0, 20.0)), []
    for k in range(40):
        begin = rng.uniform(0.0, 10.0)
        poses = line(begin, begin + 10.0)
        scans = [
            Scan(np.ones(3), np.zeros(3), 8.0, time=1e3 * (k + 1) + j) for j in range(len(poses))
        ]
        known = pruned(known.followed_by(scans, poses))
        counts.append(len(known.scans))
    assert max(counts[-10:]) <= 1.2 * max(counts[10:20])
    assert len(known.scans) < 0.4 * 40 * 40


def episode(begin: float) -> Episode:
    scans = tuple(visit(begin, True))
    return Episode(scans, Trajectory(np.array([s.time for s in scans]), np.zeros((30, 3))))


def test_a_clock_that_was_set_back_is_refused():
    known = session((MONDAY + HOUR, True))
    with pytest.raises(InputError, match=r"2026-01-05 00:00:00.*2026-01-05 01:00:03.*set back"):
        check_order(known, episode(MONDAY))
    with pytest.raises(InputError, match="1970-01-01"):
        check_order(known, episode(0.0))
    check_order(known, episode(MONDAY + 9 * 24 * HOUR))  # days without a visit
    check_order(session((0.0, True)), episode(0.0))  # stamps without a date
