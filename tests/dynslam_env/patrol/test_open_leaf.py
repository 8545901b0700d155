"""A doorway of 0.9 m at (0, 0) in a wall along x, 0.2 m deep, between two rooms 8 m wide."""

import math

import numpy as np
import pytest

from dynslam_env.patrol.door_looks import looked
from dynslam_env.patrol.place_doors import MIN_LEAF_SIGHTINGS, PlaceDoors
from dynslam_env.sensors.laser import Laser, Scanner
from slam import Pose2

HALF, FACE = 0.45, 0.1  # m
PLACE = np.array([[0.0, 0.0, 0.0, 2 * HALF]])
WALLS = [
    *((side * HALF, y, side * 4.0, y) for side in (-1, 1) for y in (-FACE, FACE)),
    *((side * HALF, -FACE, side * HALF, FACE) for side in (-1, 1)),
    *((-4.0, y, 4.0, y) for y in (-4.0, 4.0)),
    *((x, -4.0, x, 4.0) for x in (-4.0, 4.0)),
]


def square(x: float, length: float, up: bool, thick: float = 0.04):
    """Segments of something that stands on the wall at x, square to it, `length` m long."""
    inside = x - math.copysign(thick, x)
    near, far = (0.0, length) if up else (0.0, -length)
    return [(x, near, x, far), (inside, near, inside, far), (x, far, inside, far)]


def scan(pose: Pose2, more=(), time: float = 0.0):
    scanner = Scanner(Laser(), np.random.default_rng(0))
    return scanner.scan(scanner.exact(pose, np.array([*WALLS, *more])), time)


@pytest.mark.parametrize("up", [False, True])
@pytest.mark.parametrize("jamb", [-HALF, HALF])
def test_a_leaf_is_seen_on_either_side_of_the_wall_at_either_jamb(jamb, up):
    pose = Pose2(-math.copysign(1.2, jamb), -2.0, math.pi / 2)
    (_, _, leaf, towards), (_, _, none, _) = (
        looked(scan(pose, more), pose, PLACE)[0] for more in (square(jamb, 2 * HALF, up), ())
    )
    assert leaf
    assert towards == (not up)  # the robot is below the wall
    assert not none


@pytest.mark.parametrize("up", [False, True])
@pytest.mark.parametrize("length", [1.3, 2.5, 3.9])
def test_a_wall_that_meets_the_doorway_is_no_leaf(length, up):
    pose = Pose2(-1.2, -2.5, math.pi / 2)
    wall = square(HALF, length, up)
    _, _, leaf, towards = looked(scan(pose, wall), pose, PLACE)[0]
    assert not leaf
    assert towards == (not up)


def test_nothing_is_said_where_the_end_of_a_leaf_would_be_out_of_view():
    pose = Pose2(-0.1, -1.0, math.pi / 2)
    for length in (0.9, 3.9):
        _, _, leaf, towards = looked(scan(pose, square(HALF, length, False)), pose, PLACE)[0]
        assert not leaf
        assert towards


def watched(more):
    """The doorway after a few looks, in 2 s, and the doors."""
    doors, pose = PlaceDoors(), Pose2(-1.2, -2.0, math.pi / 2)
    for time in np.linspace(0.0, 2.0, 4 * MIN_LEAF_SIGHTINGS):
        doors.look(scan(pose, more, time), pose)
    (door,) = [door for door in doors.known() if door.near(0.0, 0.0, 0.0)]
    return doors, door


def test_a_door_that_stands_open_is_known_to_be_one_once_its_leaf_was_seen():
    doors, door = watched(square(HALF, 2 * HALF, True))
    assert door.has_leaf
    assert door.filter.flips == 0
    assert doors.closed(door, 2.0) < 0.05
    assert doors.closed(door, 300.0) > 0.3  # about as likely as not
    doors, bare = watched(())
    assert not bare.has_leaf
    assert doors.closed(bare, 300.0) < 0.3


def test_a_leaf_in_few_of_many_looks_is_none():
    doors, door = watched(square(HALF, 2 * HALF, True))
    assert door.has_leaf
    pose = Pose2(0.0, -2.0, math.pi / 2)
    for time in np.arange(2.5, 130.0, 0.5):
        doors.look(scan(pose, (), time), pose)
    assert door.looks > 200
    assert not door.has_leaf


def test_a_door_that_flipped_has_a_leaf_however_often_it_stands_open():
    doors, door = watched(())
    pose, shut = Pose2(0.0, -2.0, math.pi / 2), [(-HALF, 0.0, HALF, 0.0)]
    for time in np.arange(2.5, 130.0, 0.5):
        doors.look(scan(pose, shut if 20.0 < time < 22.0 else (), time), pose)
    assert door.filter.flips == 2
    assert door.has_leaf
