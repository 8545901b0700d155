"""The viewpoint table of a floor whose sights and ways are known."""

from __future__ import annotations

import numpy as np
import pytest

from agents.viewpoints.floors import Floors, bare_doorways, doorways, draw_floors, true_table
from agents.viewpoints.sights import SLICES, sights
from agents.viewpoints.table import (
    DRIVING_SPEED,
    LOOK_TIME,
    OVERHEAD,
    plans_from,
    table_of,
    visible,
)
from dynslam_env.patrol.questions import floor_costmap
from dynslam_env.worlds.layout import Door, Layout
from dynslam_env.worlds.office import Office
from slam.geometry import Pose2

RADIUS = 0.25  # m


def hall() -> Layout:
    """A hall of 20 x 4 m with a door in the southern wall at each end."""
    walls = [
        (0, 0, 1.5, 0), (2.4, 0, 17.5, 0), (18.4, 0, 20, 0), (20, 0, 20, 4), (20, 4, 0, 4),
        (0, 4, 0, 0),
    ]  # fmt: skip
    doors = (Door((1.5, 0.0), 0.0, 1, 0.9, 0.04), Door((17.5, 0.0), 0.0, 1, 0.9, 0.04))
    return Layout(np.array(walls, float), doors, Pose2(10.0, 2.0, 0.0), np.array([[10.0, 2.0]]))


def test_each_end_has_a_viewpoint_and_the_way_takes_its_time() -> None:
    table = true_table(hall(), RADIUS)
    west, east = (int(np.argmin(np.hypot(*(table.points - p).T))) for p in ((2, 2), (18, 2)))
    assert table.around[west].tolist() == [True, False]
    assert table.around[east].tolist() == [False, True]
    length = np.hypot(*(table.points[west] - table.points[east]))
    expected = length / DRIVING_SPEED + OVERHEAD + LOOK_TIME
    assert table.between[west, east] == pytest.approx(expected, rel=0.1)
    assert table.between[west, west] == LOOK_TIME
    assert table.then[west, east, 1]
    assert not table.then[west, west, 1]


def test_walls_and_flat_angles_hide_a_door() -> None:
    layout = hall()
    doors = np.array([[1.95, 0.0, 0.0, 0.9]])
    points = np.array([[1.95, 2.0], [4.0, 2.0], [6.5, 0.8]])
    costs = floor_costmap(layout, RADIUS, layout.doors)
    assert visible(costs, points, doors)[:, 0].tolist() == [True, True, False]
    screen = np.array([[0.5, 1.0, 3.0, 1.0]])
    hidden = Layout(np.vstack([layout.walls, screen]), layout.doors, layout.start, layout.path)
    assert not visible(floor_costmap(hidden, RADIUS, hidden.doors), points[:1], doors).any()


def test_on_its_way_a_robot_sees_what_is_ahead_and_not_what_it_leaves_behind() -> None:
    layout = hall()
    costs = floor_costmap(layout, RADIUS, layout.doors)
    points, doors = np.array([[5.0, 2.0], [10.0, 2.0], [15.0, 2.0]]), doorways(layout)
    table = table_of(costs, points, doors, plans_from(costs, points))
    assert table.around.tolist() == [[True, False], [False, False], [False, True]]
    assert table.then[0, 1].tolist() == [False, False]
    assert table.then[0, 2].tolist() == [False, True]
    assert table.then[2, 1].tolist() == [False, False]
    passed = np.array([[10.0, 2.0], [0.6, 0.5]])
    past = table_of(costs, passed, doors, plans_from(costs, passed))
    assert not past.around[1, 0]
    assert past.then[0, 1, 0]


def test_a_robot_sees_a_door_when_it_comes_near_and_all_around_when_it_turns() -> None:
    layout = hall()
    costs = floor_costmap(layout, RADIUS, layout.doors)
    points, doors = np.array([[10.0, 2.0], [2.5, 2.0]]), doorways(layout)
    plans = plans_from(costs, points)
    found = sights(costs, table_of(costs, points, doors, plans), plans)
    west, east = found[0, 1]  # driving west
    assert west >> SLICES - 1 & 1
    assert not west & 1  # it is too far away at first
    assert not east  # it is behind, and then too far away
    assert found[1, 1, 0] >> SLICES - 1 & 1
    assert not found[1, 1, 1]


def test_floors_are_those_of_the_split(floors: Floors) -> None:
    other = draw_floors(Office(), "test", 0, 1)
    assert not np.array_equal(floors.between[0], other.between[0])


def test_bare_doorways_are_found_and_doors_are_not_among_them() -> None:
    layout = Office(floor=3).layout(np.random.default_rng(0))
    found, doors = bare_doorways(layout), doorways(layout)
    assert len(found) >= 4
    away = np.hypot(*(found[:, None, :2] - doors[None, :, :2]).transpose(2, 0, 1))
    assert away.min() > 0.5
    assert ((found[:, 3] > 0.7) & (found[:, 3] < 1.1)).all()
