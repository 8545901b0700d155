import math
from dataclasses import replace

import numpy as np
import pytest

from dynslam_env import Corridor
from slam import InputError
from tests.dynslam_env.naive import leaf
from tests.dynslam_env.worlds import former_corridor as former


@pytest.fixture(params=range(20))
def layout(request):
    return Corridor().layout(np.random.default_rng(request.param))


def openings(layout, side):
    """Where the doors of a side hang, m along x, from their closed leaves."""
    doors = [door for door in layout.doors if door.hinge[1] * side > 0]
    spans = [(d.hinge[0], d.hinge[0] + math.cos(d.closed) * d.width) for d in doors]
    return np.sort(np.array([sorted(span) for span in spans]), axis=0)


def test_four_doors_on_each_side_uneven_and_different(layout):
    left, right = openings(layout, 1), openings(layout, -1)
    assert len(left) == len(right) == 4
    for spans in (left, right):
        gaps = spans[1:, 0] - spans[:-1, 1]
        assert (gaps >= 0.5 - 1e-9).all()
        assert np.ptp(gaps) > 0.01
    assert np.abs(left - right).max() > 0.05


def test_doors_hang_set_back_in_the_middle_of_the_wall(layout):
    for door in layout.doors:
        ys = np.abs(leaf(door, door.closed)[:, 1])
        assert ys.min() == pytest.approx(1.08)
        assert ys.max() == pytest.approx(1.12)


def test_doors_open_into_the_rooms(layout):
    for door in layout.doors:
        for opened in np.linspace(0, math.pi / 2, 19):
            ys = np.abs(leaf(door, door.closed + door.swing * opened)[:, 1])
            assert ys.min() > 1.07


def test_an_open_leaf_stays_between_its_jambs(layout):
    for door in layout.doors:
        end = door.hinge[0] + math.cos(door.closed) * 0.9
        low, high = sorted((door.hinge[0], end))
        for opened in np.linspace(0, math.pi / 2, 91):
            xs = leaf(door, door.closed + door.swing * opened)[:, 0]
            assert low - 1e-9 <= xs.min()
            assert xs.max() <= high + 1e-9


def test_the_path_goes_there_and_back_in_the_middle(layout):
    assert layout.path[0].tolist() == layout.path[-1].tolist() == [layout.start.x, layout.start.y]
    assert np.ptp(layout.path[:, 0]) == pytest.approx(10.4)
    assert not layout.path[:, 1].any()


@pytest.mark.parametrize("seed", former.DOORS)
def test_the_same_doors_as_ever_to_the_bit(seed):
    layout = Corridor().layout(np.random.default_rng(seed))
    doors = [(d.hinge[0].hex(), d.hinge[1], d.closed, d.swing) for d in layout.doors]
    assert doors == former.DOORS[seed]
    assert {(d.width, d.thickness) for d in layout.doors} == {(0.898, 0.04)}
    lengths = np.hypot(*(layout.walls[:, 2:] - layout.walls[:, :2]).T)
    assert lengths.sum() == pytest.approx(former.LENGTH)


@pytest.mark.parametrize("seed", range(40))
def test_the_same_walls_as_ever(seed):
    world = Corridor(length=14.0, width=1.7, doors_per_side=5, partition=0.12, room_depth=2.5)
    layout = world.layout(np.random.default_rng(seed))
    walls = [(0.0, -0.85, 0.0, 0.85), (14.0, -0.85, 14.0, 0.85)]
    for side in (1, -1):
        walls += former.side_walls(world, side, openings(layout, side)[:, 0] - latch(layout, side))
    assert unordered(layout.walls) == unordered(np.array(walls))


def latch(layout, side):
    """m, from where openings begin to where their closed leaves do, from left to right."""
    doors = [door for door in layout.doors if door.hinge[1] * side > 0]
    return np.array([0.0 if door.closed == 0.0 else 0.002 for door in doors])


def unordered(walls):
    rows = np.round(walls, 9) + 0.0
    return sorted(tuple(sorted([(a, b), (c, d)])) for a, b, c, d in rows.tolist())


@pytest.mark.parametrize("count", [0, 1, 8])
def test_any_number_of_doors(count):
    layout = Corridor(doors_per_side=count).layout(np.random.default_rng(0))
    assert len(layout.doors) == 2 * count


@pytest.mark.parametrize("seed", range(10))
def test_people_change_nothing_else(seed):
    empty, full = (Corridor(people=n).layout(np.random.default_rng(seed)) for n in (0, 5))
    assert empty.routes == ()
    assert len(full.routes) == 5
    assert replace(full, routes=()).plain() == empty.plain()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"length": -1.0}, "Corridor.length must be a finite number above 0, got -1.0"),
        ({"width": math.nan}, "Corridor.width"),
        ({"doors_per_side": 2.5}, "whole number of at least 0, got 2.5"),
        ({"doors_per_side": 9}, "need more than the corridor's 12 m"),
        ({"door_thickness": 0.3}, "from 0.005 to 0.2"),
        ({"people": -1}, "Corridor.people must be a whole number of at least 0"),
        ({"people": 2, "doors_per_side": 0}, "need doors_per_side of at least 1"),
        ({"people": 2, "room_depth": 1.5}, "rooms must be at least 1.6 m deep, got 1.5 m"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Corridor(**wrong)


def test_more_people_than_there_is_room_for_are_refused():
    with pytest.raises(InputError, match="there are none for person number"):
        Corridor(people=500).layout(np.random.default_rng(0))
