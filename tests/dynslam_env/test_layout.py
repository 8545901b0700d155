import math

import numpy as np
import pytest

from dynslam_env import Corridor
from slam import InputError
from tests.dynslam_env.naive import leaf


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


def test_same_seed_same_layout():
    first, second = (Corridor().layout(np.random.default_rng(3)) for _ in range(2))
    assert first.walls.tobytes() == second.walls.tobytes()
    assert first.doors == second.doors


@pytest.mark.parametrize("count", [0, 1, 8])
def test_any_number_of_doors(count):
    layout = Corridor(doors_per_side=count).layout(np.random.default_rng(0))
    assert len(layout.doors) == 2 * count


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"length": -1.0}, "Corridor.length must be a finite number above 0, got -1.0"),
        ({"width": math.nan}, "Corridor.width"),
        ({"doors_per_side": 2.5}, "whole number of at least 0, got 2.5"),
        ({"doors_per_side": 9}, "need more than the corridor's 12 m"),
        ({"door_thickness": 0.3}, "from 0 to 0.2"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Corridor(**wrong)
