"""Patrols of the fast setting: time, doors, beliefs and what is seen."""

from __future__ import annotations

import numpy as np
import pytest

from agents.viewpoints.features import FEATURES, GREEDY, features
from agents.viewpoints.floors import MAX_DOORS, Floors
from agents.viewpoints.laws import laws
from agents.viewpoints.patrols import BUDGET, EXPLORE, HISTORIES, Patrols, histories
from agents.viewpoints.policies.greedy import rates
from dynslam_env.patrol.dwell_laws import PHASES, DoorFilter, DwellLaws
from dynslam_env.patrol.slow_doors import SlowDoors
from dynslam_env.simulation.laws import Uniform


@pytest.fixture
def patrols(floors: Floors) -> Patrols:
    """Patrols that have explored for a while."""
    patrols = Patrols(floors, 6, np.random.default_rng(0))
    for _ in range(8):
        patrols.step(np.full(6, EXPLORE))
    patrols.look()
    return patrols


def test_floors_have_doors_first_and_then_doorways_without_a_leaf(floors: Floors) -> None:
    assert floors.leaves.tolist() == [5, 5]
    assert (floors.doors > floors.leaves).all()
    beyond = np.arange(MAX_DOORS) >= floors.doors[:, None]
    assert not np.any(floors.sights, axis=(1, 2))[beyond].any()


def test_a_patrol_knows_nothing_before_it_explores(floors: Floors) -> None:
    patrols = Patrols(floors, 2, np.random.default_rng(0))
    state, known = patrols.state, []
    assert np.isinf(state.age).all()
    assert not patrols.fit[:, :EXPLORE].any()
    while patrols.fit[:, EXPLORE].all():
        before = state.visited.sum(axis=1)
        error, takes, _ = patrols.step(np.full(2, EXPLORE))
        patrols.look()
        assert (state.visited.sum(axis=1) == before + 1).all()
        known.append(np.isfinite(state.age).sum(axis=1).mean())
        if len(known) == 1:
            assert error / takes == pytest.approx(0.25, abs=0.05)
    assert (np.diff(known) >= 0.0).all()
    assert known[0] < known[-1] == patrols.floors.doors[state.floor].mean()


def test_an_episode_ends_after_its_budget(patrols: Patrols) -> None:
    state = patrols.state
    over = np.zeros(6, np.bool_)
    while not over.all():
        before, here = state.time.copy(), state.place.copy()
        error, takes, over = patrols.step(patrols.fit[:, :EXPLORE].argmax(axis=1))
        assert state.time == pytest.approx(before + takes)
        there = patrols.floors.between[state.floor, here, state.place]
        assert takes == pytest.approx(there, abs=0.41)  # whole ticks
        assert (error <= takes).all()
        assert (over == (state.time >= BUDGET)).all()


def test_a_door_that_is_seen_is_known_and_one_out_of_sight_is_forgotten(patrols: Patrols) -> None:
    state, floors = patrols.state, patrols.floors
    last = floors.sights[state.floor, state.place, state.place] >= 1 << 7
    patrols.step(state.place.copy())
    p = (state.weights * state.phases[..., PHASES:].sum(axis=-1)).sum(axis=-1)
    flips = (state.flips <= state.time[:, None, None]).sum(axis=-1)
    closed = state.closed ^ (flips % 2 == 1)
    assert last.any()
    assert np.abs(p - closed)[last] == pytest.approx(0.0, abs=0.01)
    assert (state.age[last] == 0.0).all()
    real = np.arange(MAX_DOORS) < floors.doors[state.floor][:, None]
    assert (state.age[~last & real] > 0.0).all()


def test_expected_errors_are_those_of_the_forecast(patrols: Patrols) -> None:
    """The forecast of one door by the robot's own filter, with the same looks and laws."""
    state, every = patrols.state, laws()
    assert every.steps[7] == pytest.approx(np.linalg.matrix_power(every.steps[1], 7))
    assert every.steps.sum(axis=-1) == pytest.approx(1.0)
    d = int(np.isfinite(state.age[2]).argmax())
    robots = DwellLaws()
    apart = np.abs(robots.steps[None, :, 0] - every.steps[1][:, None]).sum(axis=(2, 3))
    chosen, filter_ = apart.argmin(axis=1), DoorFilter(robots)
    filter_.phases[chosen] = state.phases[2, d]
    later = state.weights[2, d] @ filter_.forecast(0.0)[chosen]
    assert patrols.stale[2, d] == pytest.approx(later * (1 - later))
    assert patrols.fresh[2, d, 0] < 0.01
    assert patrols.fresh[2, d, -1] > patrols.fresh[2, d, 2]


def test_the_first_feature_is_the_rate_of_greedy(patrols: Patrols) -> None:
    for i in range(3):
        situation = patrols.situation(i)
        found = features(situation)
        assert found.shape == (len(situation.times) + 1, FEATURES)
        expected, kept = rates(situation), np.isfinite(situation.times)
        greedy = found[:-1, GREEDY][kept]
        assert greedy == pytest.approx(expected[kept] / expected.max(), abs=0.06)
        assert patrols.features[i] == pytest.approx(found)
        assert not patrols.features[i][~patrols.fit[i]].any()


def test_histories_of_doors_keep_all_flips() -> None:
    law = Uniform(1.0, 2.0)
    closed, flips = histories(law, 2, np.random.default_rng(0))
    assert closed.shape == (HISTORIES, 2)
    counts = np.isfinite(flips).sum(axis=2)
    assert (counts > BUDGET / 2.0).all()
    gaps = np.diff(np.where(np.isfinite(flips), flips, np.nan), axis=2)
    assert np.nanmin(gaps) > 0.9
    assert np.nanmax(gaps) < 2.2


def test_the_same_seed_gives_the_same_patrols(floors: Floors) -> None:
    both = [Patrols(floors, 3, np.random.default_rng(4), SlowDoors()) for _ in range(2)]
    for patrols in both:
        for _ in range(5):
            patrols.step(patrols.features[..., GREEDY].argmax(axis=1))
            patrols.look()
    assert (both[0].features == both[1].features).all()


def test_a_leaf_is_known_once_it_was_seen(patrols: Patrols) -> None:
    """At the first look, of most doors; of some only while they are closed."""
    state = patrols.state
    leaves = np.arange(MAX_DOORS) < patrols.floors.leaves[state.floor][:, None]
    for i in range(6):
        patrols.restart(i, i % 2)
    assert np.isinf(state.hidden[~leaves]).all()
    assert set(state.hidden[leaves]) == {1.0, np.inf}
    last = patrols.floors.sights[state.floor, state.place, state.place] >= 1 << 7
    state.hidden[leaves] = np.where(np.arange(leaves.sum()) % 2, 1.0, np.inf)
    shows = state.hidden == 1.0
    state.closed[:], state.flips[:] = False, np.inf
    patrols.step(state.place.copy())
    assert (leaves & last & shows).any()
    assert (leaves & last & ~shows).any()
    assert ((state.hidden == 0.0) == (leaves & last & shows)).all()
    state.closed[leaves] = True
    patrols.step(state.place.copy())
    assert ((state.hidden == 0.0)[last] == leaves[last]).all()
