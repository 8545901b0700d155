import math

import numpy as np
import pytest

from dynslam_env import Corridor, Door, Layout
from dynslam_env.worlds.start_checks import check_start
from slam import InputError, Pose2

ROOM = [(0.0, 0.0, 6.0, 0.0), (6.0, 0.0, 6.0, 6.0), (6.0, 6.0, 0.0, 6.0), (0.0, 6.0, 0.0, 0.0)]
DOOR = Door((2.0, 4.0), 0.0, 1, 1.0, 0.1)  # closed from (2, 4) to (3, 4), opens to the north
THICK = Door((2.0, 1.0), 0.0, 1, 2.0, 2.0)
LAYOUT = Layout(np.array(ROOM), (DOOR,), Pose2(1.0, 1.0, 0.0), np.ones((1, 2)))


def check(x, y, radius=0.25, open_angle=math.pi / 2, layout=LAYOUT):
    check_start(layout, Pose2(x, y, 0.3), radius, open_angle)


@pytest.mark.parametrize(
    ("x", "y"), [(1, 1), (0.25, 3), (5.75, 5.75), (2.5, 4.26), (2.5, 3.64), (3.26, 4), (2.5, 4.8)]
)
def test_places_that_are_clear(x, y):
    check(x, y)


@pytest.mark.parametrize(
    ("x", "y", "what"),
    [
        (0.24, 3.0, r"0\.01 m inside wall 3 from \(0, 6\) to \(0, 0\)"),
        (5.9, 3.0, r"inside wall 1 from \(6, 0\) to \(6, 6\)"),
        (2.5, 4.24, r"0\.01 m inside the closed leaf of door 0, hinged at \(2, 4\)"),
        (2.5, 3.66, r"inside the closed leaf of door 0"),
        (3.2, 4.1, r"inside the closed leaf of door 0"),
        (1.8, 4.8, r"inside the open leaf of door 0"),
        (2.0, 5.2, r"inside the open leaf of door 0"),
        (2.05, 4.5, r"0\.3 m inside the open leaf of door 0"),
    ],
)
def test_places_that_are_not(x, y, what):
    with pytest.raises(InputError, match=f"cannot begin at x = {x:g}, y = {y:g} m.*{what}"):
        check(x, y)


def test_the_middle_of_a_leaf_thicker_than_the_robot():
    layout = Layout(LAYOUT.walls, (THICK,), LAYOUT.start, LAYOUT.path)
    with pytest.raises(InputError, match=r"1.2 m inside the closed leaf"):
        check(3.0, 0.0, 0.2, layout=Layout(LAYOUT.walls - 9, (THICK,), LAYOUT.start, LAYOUT.path))
    with pytest.raises(InputError, match="closed leaf"):
        check(3.0, 0.5, 0.2, layout=layout)


def test_how_far_doors_open_counts():
    with pytest.raises(InputError, match="open leaf"):
        check(1.9, 4.8)
    check(1.9, 4.8, open_angle=math.radians(60))
    with pytest.raises(InputError, match="open leaf"):
        check(2.5, 4.8, open_angle=math.radians(60))


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan])
def test_radii_are_positive(radius):
    with pytest.raises(InputError, match="the robot's radius must be a finite number above 0"):
        check(1.0, 1.0, radius)


def test_a_robot_too_large_for_the_corridor():
    layout = Corridor().layout(np.random.default_rng(0))
    check_start(layout, layout.start, 0.8, math.pi / 2)
    with pytest.raises(InputError, match="inside wall 1"):
        check_start(layout, layout.start, 0.81, math.pi / 2)
