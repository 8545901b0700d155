"""Questions: the regret of right and wrong beliefs on a floor whose ways are known."""

from __future__ import annotations

import numpy as np
import pytest

from dynslam_env.navigation.costmap import OPEN
from dynslam_env.navigation.planner import plan
from dynslam_env.patrol.questions import (
    DRIVING_SPEED,
    MARGIN,
    MAX_PLACES,
    Questions,
    floor_costmap,
)
from dynslam_env.worlds.layout import Door, Layout
from dynslam_env.worlds.office import Office
from slam.geometry import Pose2

RADIUS = 0.25  # m
PARTITION, GAP, DOOR = 6.0, 0.9, 1.0  # m: x of the partition, width of both ways through it


def two_rooms() -> Layout:
    """Two rooms of 6 x 10 m; a door near the southern end of their wall, a gap near the northern
    one."""
    walls = [
        (0, 0, 12, 0), (12, 0, 12, 10), (12, 10, 0, 10), (0, 10, 0, 0),
        (6, 0, 6, 1.0), (6, 1.9, 6, 8.1), (6, 9.0, 6, 10),
    ]  # fmt: skip
    door = Door((6.0, 1.0), np.pi / 2, 1, 0.898, 0.04)
    return Layout(np.array(walls, float), (door,), Pose2(2.0, 2.0, 0.0), np.array([[2.0, 2.0]]))


def mean_regret(closed: float, is_open: bool) -> float:
    questions = Questions(two_rooms(), RADIUS, np.random.default_rng(0))
    asked = [questions.regret(np.array([closed]), np.array([is_open])) for _ in range(100)]
    return float(np.mean([lost for lost in asked if lost is not None]))


@pytest.mark.parametrize("is_open", [True, False])
def test_a_right_belief_loses_nothing(is_open: bool) -> None:
    assert mean_regret(0.0 if is_open else 1.0, is_open) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("is_open", [True, False])
def test_a_wrong_belief_loses_time(is_open: bool) -> None:
    assert mean_regret(1.0 if is_open else 0.0, is_open) > 1.0


def test_the_loss_at_a_closed_door_is_the_way_to_it_and_back() -> None:
    questions = Questions(two_rooms(), RADIUS, np.random.default_rng(0))
    far, lost = questions._far, []
    for start in range(2, len(far)):
        for goal in range(2, len(far)):
            driven = questions._driven(start, goal, np.zeros(1), np.array([False]))
            lost.append(driven - far[start, goal])
            through = far[start, :2, None] + far[:2, goal]
            tried = min(through[0, 1], through[1, 0]) + 1.1 < far[start, goal]
            assert (lost[-1] > 0.01) <= tried
    assert 1.0 < max(lost) / DRIVING_SPEED < 60.0


def test_without_doors_nothing_is_lost() -> None:
    layout = Office(doors=0).layout(np.random.default_rng(1))
    questions = Questions(layout, RADIUS, np.random.default_rng(0))
    assert questions.regret(np.empty(0), np.empty(0, np.bool_)) == 0.0


def test_small_rooms_have_places_that_differ() -> None:
    """Of few cells each is drawn once: no question leads from a place to itself."""
    walls = [
        (0, 0, 3, 0), (3, 0, 3, 1.5), (3, 1.5, 0, 1.5), (0, 1.5, 0, 0),
        (1.5, 0, 1.5, 0.3), (1.5, 1.2, 1.5, 1.5),
    ]  # fmt: skip
    door = Door((1.5, 0.3), np.pi / 2, 1, 0.898, 0.04)
    start = Pose2(0.75, 0.75, 0.0)
    layout = Layout(np.array(walls, float), (door,), start, np.array([[0.75, 0.75]]))
    for seed in range(3):
        questions = Questions(layout, RADIUS, np.random.default_rng(seed))
        apart = questions._far[2:, 2:]
        assert 1 < len(apart) <= 16
        assert (apart[~np.eye(len(apart), dtype=bool)] > 0.0).all()


@pytest.mark.parametrize("radius", [0.105, 0.22, 0.25])
def test_the_places_are_those_of_the_whole_costmaps(radius: float) -> None:
    layout = Office().layout(np.random.default_rng(3))
    costs, opened = (floor_costmap(layout, radius, closed) for closed in (layout.doors, ()))
    there = plan(opened, layout.start).reached
    cells = np.argwhere((costs.kinds == OPEN) & (costs.clearance > radius + MARGIN) & there)
    drawn = np.random.default_rng(0).choice(len(cells), MAX_PLACES, replace=False)
    questions = Questions(layout, radius, np.random.default_rng(0))
    places = questions._nodes[2 * len(layout.doors) :]
    assert places.tobytes() == costs.spec.centres(cells[drawn]).tobytes()
