"""What scans see again of each other, and what they contradict, in a square room."""

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.interface import Estimate
from slam.motion.gaussian import Prediction
from slam.recovery.continuity import RECENT, Recent, change, sight
from slam.recovery.match import Match
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

ANGLES = np.radians(np.arange(-90.0, 90.5, 1.0))
HALF = 3.0  # m, half the side of the room


def room(pose: Pose2, blocked: slice | None = None) -> Scan:
    """The scan at a pose in the room; an obstacle at 0.6 m blocks some beams."""
    directions = ANGLES + pose.theta + 1e-9  # no beam is parallel to a wall
    x = (np.sign(np.cos(directions)) * HALF - pose.x) / np.cos(directions)
    y = (np.sign(np.sin(directions)) * HALF - pose.y) / np.sin(directions)
    ranges = np.minimum(x, y)
    if blocked is not None:
        ranges[blocked] = 0.6
    return Scan(ranges, ANGLES, max_range=8.0)


def changed(before: Scan, after: Scan, displacement: Pose2) -> float:
    return change(sight(before), sight(after), displacement)


@pytest.mark.parametrize("moved", [Pose2(0.1, 0.0, 0.0), Pose2(0.1, 0.05, 0.17), Pose2()])
def test_a_robot_that_drives_sees_the_same_room(moved):
    assert changed(room(Pose2()), room(moved), moved) == 0.0


def test_something_that_moves_changes_its_share_of_the_scan():
    share = changed(room(Pose2(), slice(30, 50)), room(Pose2(), slice(80, 100)), Pose2())
    obstacle = 0.6 * np.radians(20.0)  # m, it is gone from one place and came to the other
    assert share == pytest.approx(2 * obstacle / (4 * HALF), abs=0.02)  # of half the walls


def test_what_only_comes_or_only_goes_does_not_move_the_robot():
    """A door that closes before the laser hides half of what it saw, and nothing appears."""
    door = room(Pose2(), slice(60, 130))
    assert changed(room(Pose2()), door, Pose2()) == 0.0
    assert changed(door, room(Pose2()), Pose2()) == 0.0


def test_a_robot_that_was_carried_sees_all_of_it_changed():
    elsewhere = Pose2(2.0, -2.0, 2.0)
    assert changed(room(Pose2()), room(elsewhere), Pose2(0.02, 0.0, 0.0)) > 0.3


def test_the_order_of_the_beams_does_not_matter():
    def reversed_(scan: Scan) -> Scan:
        return Scan(scan.ranges[::-1].copy(), scan.angles[::-1].copy(), scan.max_range)

    before, after = room(Pose2()), room(Pose2(0.3, 0.2, 0.4), slice(20, 60))
    wrong = Pose2(0.1, 0.0, 0.0)
    expected = changed(before, after, wrong)
    assert expected > 0.1
    assert changed(reversed_(before), reversed_(after), wrong) == pytest.approx(expected, abs=0.02)


def test_beams_without_a_reading_contradict_nothing():
    nothing = Scan(np.full(len(ANGLES), np.nan), ANGLES, max_range=8.0)
    assert changed(nothing, room(Pose2()), Pose2()) == 0.0
    assert changed(room(Pose2()), nothing, Pose2()) == 0.0


def seen_again(before: Scan, after: Scan, displacement: Pose2) -> float:
    recent, prediction = Recent(), Prediction(Pose2(), Pose2(), np.full(3, 0.05))
    estimate = Estimate(Pose2(), np.zeros((3, 3)), 0.0, True)
    recent.add(Match(Endpoint(), before, Pose2(), prediction, estimate))
    match = Match(Endpoint(), after, Pose2(), prediction, estimate)
    return float(recent.overlaps(match, displacement)[0, 0])


@pytest.mark.parametrize("moved", [Pose2(0.1, 0.0, 0.0), Pose2(0.1, 0.05, 0.17), Pose2()])
def test_a_robot_that_drives_sees_the_same_surfaces(moved):
    assert seen_again(room(Pose2()), room(moved), moved) == 1.0


def test_what_is_out_of_view_is_not_counted():
    turn = Pose2(0.0, 0.0, np.radians(60.0))
    assert seen_again(room(Pose2()), room(turn), turn) == 1.0


def test_at_a_wrong_place_it_sees_other_surfaces():
    moved = Pose2(0.1, 0.0, 0.0)
    assert seen_again(room(Pose2()), room(moved), Pose2(0.4, 0.2, 0.0)) < 0.3


def test_a_square_room_looks_like_itself_turned_around():
    turned = Pose2(0.0, 0.0, np.pi / 2)
    assert seen_again(room(Pose2()), room(Pose2()), turned) == 1.0


@pytest.mark.parametrize("first", [0.0, -np.pi])
def test_a_laser_may_count_its_angles_from_0_or_from_minus_pi(first):
    angles = first + np.radians(np.arange(0.0, 360.0, 1.0))
    before, after = (
        Scan(np.interp(np.mod(angles, 2 * np.pi), around, ranges), angles, max_range=8.0)
        for around, ranges in (all_around(Pose2()), all_around(Pose2(0.2, 0.1, 0.0)))
    )
    assert seen_again(before, after, Pose2(0.2, 0.1, 0.0)) > 0.95
    assert seen_again(before, after, Pose2(1.2, 0.1, 0.0)) < 0.8
    assert changed(before, after, Pose2(0.2, 0.1, 0.0)) == 0.0
    assert changed(before, after, Pose2(1.2, 0.1, 0.0)) > 0.4


def all_around(pose: Pose2) -> tuple[np.ndarray, np.ndarray]:
    """Angles from 0 to 2 pi, and the ranges there, in the room."""
    around = np.radians(np.arange(0.0, 360.5, 0.25)) + 1e-9
    x = (np.sign(np.cos(around)) * HALF - pose.x) / np.cos(around)
    y = (np.sign(np.sin(around)) * HALF - pose.y) / np.sin(around)
    return around, np.minimum(x, y)


def keyframe(last: Pose2, believed: Pose2, true: Pose2) -> Match:
    prediction = Prediction(believed, Pose2(), np.full(3, 0.05))
    estimate = Estimate(believed, np.zeros((3, 3)), 0.0, True)
    return Match(Endpoint(), room(true), last, prediction, estimate)


def test_scans_before_a_slip_agree_with_the_corrected_pose_and_those_after_it_do_not():
    recent, step = Recent(), 0.1
    for k in range(RECENT):
        x = k * step
        slipped = 0.4 if k >= RECENT - 2 else 0.0  # the last two keyframes are believed too far
        last = Pose2((k - 1) * step + (0.4 if k >= RECENT - 1 else 0.0), 0.0, 0.0)
        recent.add(keyframe(last, Pose2(x + slipped, 0.0, 0.0), Pose2(x, 0.0, 0.0)))
    last = Pose2((RECENT - 1) * step + 0.4, 0.0, 0.0)
    true = Pose2(RECENT * step, 0.0, 0.0)
    match = keyframe(last, Pose2(true.x + 0.4, 0.0, 0.0), true)
    believed, corrected = (
        recent.overlaps(match, pose)[:, 0] for pose in (match.estimate.pose, true)
    )
    assert (believed[:2] == 1.0).all()
    assert (believed[2:] < 0.8).all()
    assert (corrected[:2] < 0.8).all()
    assert (corrected[2:] == 1.0).all()


def test_keyframes_far_apart_are_not_compared():
    recent = Recent()
    recent.add(keyframe(Pose2(), Pose2(0.1, 0.0, 0.0), Pose2(0.1, 0.0, 0.0)))
    assert recent.add(keyframe(Pose2(0.1, 0.0, 0.0), Pose2(2.0, 0.0, 0.0), Pose2())) == 0.0
    assert len(recent.overlaps(keyframe(Pose2(2.0), Pose2(2.1), Pose2(0.1)), Pose2(2.1))) == 1


def before_a_leaf(turned: float) -> Scan:
    """The room, and before the laser a leaf of 0.9 m: it fills 110 of 181 beams."""
    open_room, beams = room(Pose2()), slice(35, 145)
    ranges = open_room.ranges.copy()
    ranges[beams] = 0.3 / np.cos(ANGLES[beams] - turned)
    return Scan(ranges, ANGLES, max_range=8.0)


def test_a_leaf_before_the_laser_counts_by_its_length_not_by_its_beams():
    recent, still = Recent(), Pose2()
    recent.add(keyframe(still, still, still)._replace(scan=before_a_leaf(0.0)))
    after = keyframe(still, still, still)._replace(scan=before_a_leaf(0.4))
    share, number = recent.overlaps(after, still)[0]
    assert number < 70  # pieces of 0.1 m, or beams farther apart
    assert share > 0.75
    whole_room = keyframe(still, still, still)
    recent.add(whole_room)
    assert recent.overlaps(whole_room, still)[0, 1] > 90


def test_a_robot_that_turns_quickly_sees_much_the_same():
    turned = Pose2(0.05, 0.0, np.radians(40.0))
    recent = Recent()
    recent.add(keyframe(Pose2(), Pose2(), Pose2()))
    recent.add(keyframe(Pose2(), turned, turned))
    assert len(recent.overlaps(keyframe(turned, turned, turned), turned)) == 2


def test_the_latest_scan_tells_by_how_much_the_heading_of_a_match_is_wrong():
    recent, step, wrong = Recent(), Pose2(0.1), np.radians(-20.0)
    recent.add(keyframe(Pose2(), Pose2(), Pose2(1.0, 0.5, 0.3)))
    match = keyframe(Pose2(), step @ Pose2(0.0, 0.0, wrong), Pose2(1.0, 0.5, 0.3) @ step)
    assert recent.as_seen_last(match).theta == pytest.approx(0.0, abs=0.1)
    assert recent.as_seen_last(match)[:2] == pytest.approx(step[:2])
