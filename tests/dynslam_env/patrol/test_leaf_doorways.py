"""Doorways that are no gap in a straight wall to a single scan, and doors behind doors."""

import math

import numpy as np
import pytest

from dynslam_env.patrol.door_shapes import suspects
from dynslam_env.sensors.laser import Laser, Scanner
from slam import Pose2

HALF, FACE = 0.45, 0.1  # m: of the doorway, at (0, 0) in a wall along x
UP = math.pi / 2
ROOM = [(-5.0, y, 5.0, y) for y in (-4.0, 4.0)] + [(x, -4.0, x, 4.0) for x in (-5.0, 5.0)]
LEFT = [(-5.0, y, -HALF, y) for y in (-FACE, FACE)] + [(-HALF, -FACE, -HALF, FACE)]
CORNER = [(HALF, -FACE, HALF, FACE), (HALF, -FACE, HALF + 0.1, -FACE),
          (HALF + 0.1, -FACE, HALF + 0.1, FACE)]  # fmt: skip


def leaf(length: float, y: float = -FACE, x: float = HALF):
    """Segments of a leaf at the right jamb that stands towards the robot, below the wall."""
    end, back = y - length, x + 0.04
    return [(x, y, x, end), (back, y, back, end), (x, end, back, end)]


def shapes(pose: Pose2, segments) -> np.ndarray:
    scanner = Scanner(Laser(), np.random.default_rng(0))
    return suspects(scanner.scan(scanner.exact(pose, np.array(segments)), 0.0), pose)


@pytest.mark.parametrize("x", [-2.0, -1.2, -0.6])
@pytest.mark.parametrize("beyond", [[], CORNER])
def test_a_leaf_shows_a_doorway_whose_other_wall_is_hidden_or_short(x, beyond):
    pose = Pose2(x, -2.0, UP)
    ((mx, my, direction, width, closed),) = shapes(pose, ROOM + LEFT + beyond + leaf(0.9))
    assert (mx, my) == pytest.approx((0.0, -FACE), abs=0.06)
    assert math.sin(direction) == pytest.approx(0.0, abs=0.06)
    assert width == pytest.approx(2 * HALF, abs=0.06)
    assert not closed


def test_it_is_found_in_a_mirror_by_a_robot_that_is_turned():
    mirrored = [(-a, b, -c, d) for a, b, c, d in ROOM + LEFT + leaf(0.9)]
    ((x, y, *_),) = shapes(Pose2(1.2, -2.0, UP + 0.4), mirrored)
    assert (x, y) == pytest.approx((0.0, -FACE), abs=0.06)


@pytest.mark.parametrize("length", [0.4, 0.6, 1.4, 3.9])
def test_a_wall_of_another_length_than_the_gaps_is_no_leaf(length):
    assert len(shapes(Pose2(-1.2, -2.0, UP), ROOM + LEFT + leaf(length))) == 0


def test_what_stands_square_to_a_wall_without_a_gap_is_no_leaf():
    wall = [(-5.0, -FACE, 5.0, -FACE)]
    assert len(shapes(Pose2(-1.2, -2.0, UP), ROOM + wall + leaf(0.9))) == 0


@pytest.mark.parametrize("away", [0.7, 1.3])
def test_a_gap_of_another_width_than_the_leafs_is_no_door(away):
    segments = ROOM + LEFT + leaf(0.9, x=-HALF + away)
    assert len(shapes(Pose2(-1.2, -2.0, UP), segments)) == 0


@pytest.mark.parametrize("closed", [False, True])
def test_a_doorway_is_recognised_through_another_one(closed):
    right = [(-a, b, -c, d) for a, b, c, d in LEFT]
    behind = [(a, b + 2.0, c, d + 2.0) for a, b, c, d in LEFT + right]
    shut = [(-HALF, 2.0, HALF, 2.0)] if closed else []
    found = shapes(Pose2(0.0, -2.0, UP), ROOM + LEFT + right + behind + shut)
    assert len(found) == 2
    assert sorted(found[:, 1]) == pytest.approx([-FACE, 2.0 - FACE], abs=0.06)
    assert found[np.argsort(found[:, 1]), 4].tolist() == [0.0, float(closed)]


def test_a_slanted_panel_is_no_leaf():
    panel = [(HALF, -FACE, HALF - 0.3, -FACE - 0.85)]
    assert len(shapes(Pose2(-1.2, -2.0, UP), ROOM + LEFT + panel)) == 0


def test_a_short_piece_of_wall_is_none():
    short = [(-HALF - 0.15, y, -HALF, y) for y in (-FACE, FACE)] + LEFT[-1:]
    assert len(shapes(Pose2(-1.2, -2.0, UP), ROOM + short + leaf(0.9))) == 0


def test_a_gap_that_is_blocked_is_no_open_door():
    blocked = [(-HALF, 0.0, HALF, 0.0)]
    assert len(shapes(Pose2(-1.2, -2.0, UP), ROOM + LEFT + leaf(0.9) + blocked)) == 0
