"""Policies of viewpoints, in situations whose best choice is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from agents.viewpoints.policies.greedy import Greedy
from agents.viewpoints.policies.look_ahead import LookAhead
from agents.viewpoints.policies.monte_carlo_entropy import MonteCarloEntropy
from agents.viewpoints.policies.stand import Stand
from agents.viewpoints.policies.tour import Tour
from agents.viewpoints.policies.whittle import Whittle, indices
from agents.viewpoints.situation import GRID, DoorRows, Situation, ViewpointPolicy, at, summed
from dynslam_env.navigation.door_belief import HORIZONS

RATE = 1 / 80  # 1/s, at which a door is forgotten
AWAY = 20.0  # s, from a viewpoint to another


def doors(ages: list[float], bare: tuple[int, ...] = ()) -> DoorRows:
    """Doors last seen `ages` s ago, whose error grows towards 0.25; bare ones stay known."""
    age = np.array(ages)
    scale = np.array([0.0 if d in bare else 0.25 for d in range(len(ages))])

    def error(ahead: np.ndarray) -> np.ndarray:
        return scale[:, None] * (1.0 - np.exp(-RATE * ahead))

    stale = error(np.minimum(age[:, None], 1e4) + HORIZONS)
    fresh = error(np.broadcast_to(HORIZONS, stale.shape))
    closed = 0.5 - np.sqrt(np.maximum(0.25 - stale[:, 0], 0.0))
    leaf = np.array([d not in bare for d in range(len(ages))])
    return DoorRows(closed, age, leaf, stale, fresh)


def star(shown: list[list[int]], rows: DoorRows, last: int = 0) -> Situation:
    """Viewpoints AWAY from each other, with a look around of 3 s; `shown` are those of each."""
    v, d = len(shown), len(rows.age)
    between = np.full((v, v), AWAY) - (AWAY - 3.0) * np.eye(v)
    around = np.zeros((v, d), np.bool_)
    for k, numbers in enumerate(shown):
        around[k, numbers] = True
    then = np.repeat(around[None], v, axis=0)
    return Situation(between[last], then[last], between, then, rows, last)


PLANNERS = [Greedy, Whittle, LookAhead]


@pytest.mark.parametrize("policy", PLANNERS)
def test_planners_drive_to_the_door_unseen_longest(policy: Callable[[], ViewpointPolicy]) -> None:
    assert policy().choose(star([[0], [1], [2]], doors([0.0, 20.0, 200.0]))) == 2


@pytest.mark.parametrize("policy", PLANNERS)
def test_planners_drive_to_no_bare_doorway(policy: Callable[[], ViewpointPolicy]) -> None:
    rows = doors([0.0, 60.0, 300.0, 300.0], bare=(2, 3))
    assert policy().choose(star([[0], [1], [2, 3]], rows)) == 1


@pytest.mark.parametrize("policy", PLANNERS)
def test_planners_choose_no_viewpoint_without_a_path(policy: Callable[[], ViewpointPolicy]) -> None:
    situation = star([[0], [1], [2]], doors([0.0, 20.0, 200.0]))
    situation.times[2] = np.inf
    assert policy().choose(situation) == 1


def test_looking_ahead_prefers_the_side_with_two_doors() -> None:
    """One far door saves more per second than each of two near ones, but not than both."""
    situation = star([[0], [1], [2], [3]], doors([0.0, 60.0, 60.0, 70.0]))
    situation.between[:] = 30.0
    situation.between[1, 2] = situation.between[2, 1] = 4.0
    situation.times[:] = [3.0, 30.0, 30.0, 30.0]
    assert Greedy().choose(situation) == 3
    assert LookAhead().choose(situation) in (1, 2)


def test_stand_stays_where_most_doors_are_seen_without_bare_ones() -> None:
    situation = star([[0], [1, 2], [3, 4, 5]], doors([0.0] * 6, bare=(3, 4, 5)))
    assert Stand().choose(situation) == 1


def test_a_tour_shows_every_door_and_comes_back() -> None:
    rows, place, seen = doors([50.0] * 5, bare=(4,)), 0, []
    shown = [[0], [1, 2], [3], [2], [4]]
    for _ in range(6):
        place = Tour().choose(star(shown, rows, place))
        seen.append(place)
    assert seen[:3] == seen[3:]
    assert sorted(seen[:3]) == [0, 1, 2]


def test_monte_carlo_draws_in_proportion_to_entropy() -> None:
    rows = doors([300.0, 300.0, 300.0, 0.0])
    drawn = MonteCarloEntropy(np.random.default_rng(0))
    chosen = [drawn.choose(star([[0], [1, 2], [3]], rows)) for _ in range(600)]
    shares = np.bincount(chosen, minlength=3) / 600
    assert shares == pytest.approx([1 / 3, 2 / 3, 0.0], abs=0.06)


def test_whittles_index_is_the_price_at_which_waiting_and_looking_cost_the_same() -> None:
    age, step, error = 60.0, 0.01, lambda a: 0.25 * (1.0 - np.exp(-RATE * a))
    index = indices(star([[0]], doors([age])))[0]
    ages = np.arange(0.0, age + 2 * step, step) + step / 2

    def mean_cost(until: float) -> float:
        return (error(ages[ages < until]).sum() * step + index) / until

    assert mean_cost(age) == pytest.approx(mean_cost(age + step), rel=1e-4)
    assert mean_cost(0.7 * age) > mean_cost(age) < mean_cost(age + step) + 1e-3


def test_integrals_of_errors() -> None:
    constant = np.full((2, len(HORIZONS)), 0.1)
    assert summed(constant) == pytest.approx(0.1 * np.tile(GRID, (2, 1)))
    assert at(summed(constant), np.array([[12.0, 33.0]])) == pytest.approx(np.array([[1.2, 3.3]]))
