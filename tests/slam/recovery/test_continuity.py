"""How much of what one scan saw the next one contradicts, in a square room."""

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.recovery.continuity import change, sight
from slam.scan import Scan

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
    share = changed(room(Pose2()), room(Pose2(), slice(80, 100)), Pose2())
    assert share == pytest.approx(20 / 177, abs=0.01)  # of the beams with two neighbours a side


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
