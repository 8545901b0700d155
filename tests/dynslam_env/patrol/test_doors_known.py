import math

import numpy as np
import pytest

from dynslam_env import Door, Layout
from dynslam_env.patrol.doors_known import LEAF_SHARES, SIDE_CELLS, DoorsKnown, brier, closed
from dynslam_env.patrol.memory import CELL_SIZE, DynamicMap
from slam import Pose2

from .drawn import UP, wall

DOOR = Door((-0.45, 2.05), 0.0, 1, 0.9, 0.04)  # across the way of who looks up
WALLS = [(-5.0, 9.0, 5.0, 9.0)]
OPEN, SHUT = np.array([math.pi / 2]), np.array([0.0])


def known(*doors):
    return DoorsKnown(Layout(np.array(WALLS), doors, Pose2(), np.array([(1.0, 0.0)])))


def seen(ahead):
    memory = DynamicMap()
    for k in range(20):
        memory.look(wall(ahead, 0.2 * k), UP)
    return memory


@pytest.mark.parametrize("door", [DOOR, Door((0.45, 2.05), math.pi, -1, 0.9, 0.04)])
def test_a_memory_that_is_right_has_no_error_and_one_that_is_wrong_all(door):
    for memory, right, wrong in ((seen(2.03), SHUT, OPEN), (seen(4.0), OPEN, SHUT)):
        assert known(door).brier(memory, 3.8, right) == pytest.approx(0.0, abs=0.02)
        assert known(door).brier(memory, 3.8, wrong) == pytest.approx(1.0, abs=0.1)


def test_of_a_door_that_was_never_seen_nothing_is_known():
    away = DOOR._replace(hinge=(30.0, 30.0))
    for memory in (DynamicMap(), seen(2.03)):
        for openings in (OPEN, SHUT):
            assert known(away).brier(memory, 3.8, openings) == 0.25


def test_the_map_is_read_along_the_closed_leaf_and_a_cell_beside_it():
    doors = [Door((1.0, 2.0), 0.7, 1, 0.9, 0.04), Door((-3.0, 0.5), -2.0, -1, 0.6, 0.2)]
    points = known(*doors)._points.reshape(2, len(LEAF_SHARES), len(SIDE_CELLS), 2)
    for door, read in zip(doors, points, strict=True):
        along = np.array([math.cos(door.closed), math.sin(door.closed)])
        across = np.array([-along[1], along[0]])
        out = (LEAF_SHARES - 0.5) * door.width
        assert (read - door.middle) @ along == pytest.approx(np.tile(out, (3, 1)).T)
        assert (read - door.middle) @ across == pytest.approx(
            np.tile(SIDE_CELLS * CELL_SIZE, (8, 1))
        )


def test_it_is_the_mean_over_doors():
    away = DOOR._replace(hinge=(30.0, 30.0))
    both = known(DOOR, away).brier(seen(2.03), 3.8, np.array([0.0, 0.0]))
    assert both == pytest.approx(0.125, abs=0.01)


def test_a_door_that_is_ajar_is_closed():
    memory = seen(2.03)
    assert known(DOOR).brier(memory, 3.8, np.array([0.19])) < 0.1
    assert known(DOOR).brier(memory, 3.8, np.array([0.21])) > 0.9


def test_without_doors_there_is_nothing_to_know():
    assert math.isnan(known().brier(DynamicMap(), 0.0, np.empty(0)))


def test_closed_is_the_mean_along_the_leaf_of_what_is_most_occupied_near_it():
    near = np.full((2, 3, 3), np.nan)
    near[0, 0] = 0.1, np.nan, 0.9
    near[0, 1] = 0.3, 0.2, 0.1
    assert closed(near) == pytest.approx([0.6, 0.5])


def test_many_at_once_are_as_one_by_one():
    rng = np.random.default_rng(0)
    near, openings = rng.random((5, 3, 8, 3)), rng.uniform(0, 0.4, (5, 3))
    near[rng.random(near.shape) < 0.5] = np.nan
    each = [brier(a, b) for a, b in zip(near, openings, strict=True)]
    assert brier(near, openings) == pytest.approx(np.array(each))
