import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dynslam_env.worlds.floor_plan import Doorway, FloorPlan
from dynslam_env.worlds.outline import Rect
from slam import InputError
from tests.dynslam_env.naive import leaf

MIDDLE = Rect(0.0, 0.0, 4.0, 4.0)
EAST, NORTH = Rect(4.2, 0.0, 8.0, 4.0), Rect(0.0, 4.2, 4.0, 8.0)
SPACES = (MIDDLE, EAST, NORTH)


def plan(*doorways, spaces=SPACES):
    return FloorPlan(spaces, doorways)


@pytest.mark.parametrize("neighbour", [1, 2])
@pytest.mark.parametrize("pair", [(0, 1), (1, 0)])
@pytest.mark.parametrize("into_neighbour", [True, False])
@pytest.mark.parametrize("at_start", [True, False])
def test_a_leaf_hangs_in_the_middle_of_its_wall_and_opens_where_it_should(
    neighbour, pair, into_neighbour, at_start
):
    spaces = tuple((0, neighbour)[each] for each in pair)
    opens_to = neighbour if into_neighbour else 0
    (door,) = plan(Doorway(spaces, 1.0, 0.9, opens_to, at_start)).doors
    across = 0 if neighbour == 1 else 1  # the axis across the wall
    closed = leaf(door, door.closed)[:, :2]
    assert closed[:, across].min() == pytest.approx(4.08)
    assert closed[:, across].max() == pytest.approx(4.12)
    hinge, free = (1.0, 1.898) if at_start else (1.9, 1.002)
    assert closed[:2, 1 - across].tolist() == pytest.approx([hinge, free])
    tip = leaf(door, door.closed + door.swing * math.pi / 2)[1, :2]
    assert tip[across] == pytest.approx(4.12 + 0.898 if into_neighbour else 4.08 - 0.898)
    assert tip[1 - across] == pytest.approx(hinge)


def test_walls_leave_the_openings_free():
    walls = plan(Doorway((0, 1), 1.0, 0.9), Doorway((0, 2), 2.0, 0.9, 2)).walls
    length = np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum()
    assert length == pytest.approx(16.0 + 15.6 + 15.6 - 4 * 0.9 + 4 * 0.2)
    assert len(walls) == 3 * 4 + 2 * 4  # each opening cuts two walls and has two jambs
    assert len(plan(Doorway((0, 1), 1.0, 0.9)).doors) == 0


def test_spaces_that_touch_are_joined():
    touching = (MIDDLE, Rect(4.0, 1.0, 8.0, 3.0))
    assert len(plan(Doorway((0, 1), 1.0, 2.0), spaces=touching).walls) == 8


@pytest.mark.parametrize(
    ("doorway", "message"),
    [
        (Doorway((0, 3), 1.0, 0.9), r"FloorPlan.doorways\[0\].spaces .* from 0 to 2, got 3"),
        (Doorway((0, -1), 1.0, 0.9), r"spaces must be a whole number of at least 0, got -1"),
        (Doorway((1, 2), 1.0, 0.9), r"needs a wall between its spaces .* there is none"),
        (Doorway((0, 0), 1.0, 0.9), r"needs a wall between its spaces .* there is none"),
        (Doorway((0, 1), 3.5, 0.9), r"from 3.5 to 4.4 m, there is one from 0 to 4 m"),
        (Doorway((0, 1), -0.1, 0.9), r"there is one from 0 to 4 m"),
        (Doorway((0, 1), 1.0, 0.0), r"width must be a finite number above 0, got 0.0"),
        (Doorway((0, 1), math.nan, 0.9), r"start must be a finite number"),
        (Doorway((0, 1), 1.0, 0.9, 2), r"opens_to must be one of None, 0, 1, got 2"),
    ],
)
def test_doorways_that_cannot_be_are_refused(doorway, message):
    with pytest.raises(InputError, match=message):
        plan(doorway)


@pytest.mark.parametrize(
    ("spaces", "message"),
    [
        ((MIDDLE, Rect(3.9, 0.0, 8.0, 4.0)), r"must not overlap, but \[0\] and \[1\] do"),
        ((MIDDLE, MIDDLE), r"must not overlap"),
        ((Rect(0.0, 0.0, 0.0, 4.0),), r"spaces\[0\] needs left < right"),
        ((MIDDLE, Rect(5.0, 0.0, math.inf, 4.0)), r"spaces\[1\].right must be a finite number"),
    ],
)
def test_spaces_that_cannot_be_are_refused(spaces, message):
    with pytest.raises(InputError, match=message):
        plan(spaces=spaces)


def test_a_leaf_thicker_than_its_wall_is_refused():
    with pytest.raises(InputError, match=r"leaf of 0.3 m, thicker than its wall of 0.2 m"):
        FloorPlan(SPACES, (Doorway((0, 1), 1.0, 0.9, 1),), 0.3)


def test_other_doorways_in_the_same_spaces():
    first, second = Doorway((0, 1), 1.0, 0.9, 1), Doorway((0, 2), 2.0, 0.8, 2, slides=True)
    changed, built = plan(first).with_doorways((first, second)), plan(first, second)
    assert changed.doors == built.doors
    assert len(built.doors) == 2
    np.testing.assert_array_equal(changed.walls, built.walls)
    assert changed.spaces == built.spaces
    assert changed.door_thickness == built.door_thickness


@given(
    st.tuples(st.integers(-1, 3), st.integers(-1, 3)),
    st.floats(-1.0, 5.0) | st.sampled_from([0.0, 3.1, math.nan, math.inf]),
    st.floats(0.0, 5.0) | st.sampled_from([0.9, math.nan, 5e-324]),
    st.sampled_from([None, 0, 1, 2]),
)
def test_the_short_check_of_a_doorway_says_what_the_long_one_says(pair, start, width, into):
    doorway, place = Doorway(pair, start, width, into), plan()
    try:
        place._check_doorway("it", doorway)
        right = True
    except InputError:
        right = False
    assert place._plainly_fits(doorway) <= right
    if right and width > 1e-9:
        assert place._plainly_fits(doorway)
