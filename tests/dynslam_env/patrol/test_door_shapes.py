import math

import numpy as np
import pytest

from dynslam_env.patrol.door_looks import looked
from dynslam_env.patrol.door_shapes import suspects
from dynslam_env.patrol.echoes import MAX_SPACING, MAX_WIDTH, aside
from slam import Pose2

from .doorway import FACE, HALF_WIDTH, doorway

FACING = Pose2(0.0, 0.0, math.pi / 2)
PLACE = np.array([0.0, FACE + 0.1, 0.0, 2 * HALF_WIDTH])


@pytest.mark.parametrize("closed", [False, True])
def test_a_doorway_is_recognised_open_and_closed(closed):
    ((x, y, direction, width, shut),) = suspects(doorway(closed), FACING)
    assert (x, y) == pytest.approx((0.0, FACE), abs=0.05)
    assert math.sin(direction) == pytest.approx(0.0, abs=0.05)
    assert width == pytest.approx(2 * HALF_WIDTH, abs=0.05)
    assert shut == closed


@pytest.mark.parametrize("half", [0.0, 0.2, 1.0])
def test_walls_and_gaps_of_another_width_are_no_doors(half):
    for closed in (False, True):
        assert len(suspects(doorway(closed, half=half), FACING)) == 0


def test_it_is_found_where_the_robot_is():
    moved = Pose2(3.0, -1.0, 0.3) @ FACING
    ((x, y, *_),) = suspects(doorway(True), moved)
    expected = Pose2(3.0, -1.0, 0.3) @ Pose2(0.0, FACE, 0.0)
    assert (x, y) == pytest.approx(expected[:2], abs=0.05)


def test_beams_end_at_a_closed_door_and_pass_an_open_one():
    reached, ended, leaf, towards = looked(doorway(True), FACING, PLACE[None])[0]
    assert reached > 10
    assert ended == reached
    assert not leaf
    assert not towards
    reached, ended, *_ = looked(doorway(False), FACING, PLACE[None])[0]
    assert reached > 10
    assert ended == 0


def test_a_doorway_behind_the_robot_or_behind_a_wall_is_not_looked_at():
    hidden = np.array([[0.0, -2.0, 0.0, 0.9], [2.0, FACE + 1.0, 0.0, 0.9]])
    assert (looked(doorway(True), FACING, hidden)[:, 0] == 0).all()


@pytest.mark.parametrize("away", [1.6, 2.0, 4.0, 7.0])
def test_beams_farther_aside_pass_an_echo_by_more_than_a_door(away):
    widest = MAX_WIDTH + 2.0 * MAX_SPACING
    angle = aside(away, math.pi)
    angles, ranges = np.meshgrid(np.linspace(angle, math.tau - angle, 200), np.linspace(0, 9, 300))
    apart = np.hypot(ranges * np.cos(angles) - away, ranges * np.sin(angles))
    assert apart.min() > widest
    nearest = away * math.sin(0.99 * angle)
    assert nearest < 1.01 * widest  # no beam more is kept than need be


def test_all_beams_count_beside_a_near_echo_or_where_the_view_comes_round():
    assert aside(1.0, math.pi) == math.inf
    assert aside(4.0, 1.9 * math.pi) == math.inf
