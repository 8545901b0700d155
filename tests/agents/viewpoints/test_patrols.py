"""Patrols of the fast setting: time, doors, beliefs and what is seen."""

from __future__ import annotations

import numpy as np
import pytest

from agents.viewpoints.features import FEATURES, GREEDY, features
from agents.viewpoints.floors import MAX_DOORS, Floors
from agents.viewpoints.patrols import BUDGET, EXPLORING, HISTORIES, Patrols, histories, laws
from agents.viewpoints.policies.greedy import rates
from dynslam_env.navigation.door_belief import HORIZONS
from dynslam_env.patrol.slow_doors import SlowDoors
from dynslam_env.simulation.laws import Uniform


@pytest.fixture
def patrols(floors: Floors) -> Patrols:
    return Patrols(floors, 6, np.random.default_rng(0))


def test_floors_have_doors_first_and_then_doorways_without_a_leaf(floors: Floors) -> None:
    assert floors.leaves.tolist() == [5, 5]
    assert (floors.doors > floors.leaves).all()
    beyond = np.arange(MAX_DOORS) >= floors.doors[:, None]
    assert not np.any(floors.sights, axis=(1, 2))[beyond].any()


def test_an_episode_begins_after_exploring_and_ends_after_its_budget(patrols: Patrols) -> None:
    state = patrols.state
    assert (state.begun >= EXPLORING[0]).all()
    assert (state.visited.sum(axis=1) > 1).all()
    assert (state.error == 0.0).all()
    over = np.zeros(6, np.bool_)
    while not over.all():
        before, here = state.time.copy(), state.place.copy()
        error, takes, over = patrols.step(patrols.fit.argmax(axis=1))
        assert state.time == pytest.approx(before + takes)
        there = patrols.floors.between[state.floor, here, state.place]
        assert takes == pytest.approx(there)
        assert (error <= takes).all()
        assert (over == (state.time >= BUDGET)).all()


def test_a_door_that_is_seen_is_known_and_one_out_of_sight_is_forgotten(patrols: Patrols) -> None:
    state, floors = patrols.state, patrols.floors
    last = floors.sights[state.floor, state.place, state.place] >= 1 << 7
    patrols.step(state.place.copy())
    p = (state.weights * state.p).sum(axis=-1)
    flips = (state.flips <= state.time[:, None, None]).sum(axis=-1)
    closed = state.closed ^ (flips % 2 == 1)
    assert last.any()
    assert np.abs(p - closed)[last] == pytest.approx(0.0, abs=0.01)
    assert (state.age[last] == 0.0).all()
    real = np.arange(MAX_DOORS) < floors.doors[state.floor][:, None]
    assert (state.age[~last & real] > 0.0).all()


def test_expected_errors_are_those_of_the_forecast(patrols: Patrols) -> None:
    """A naive forecast of one door by its mixture of laws."""
    state, every = patrols.state, laws()
    w, p = state.weights[2, 1], state.p[2, 1]
    later = [(w * (every.share + (p - every.share) * np.exp(-every.rate * t))).sum()
             for t in HORIZONS]  # fmt: skip
    assert patrols.stale[2, 1] == pytest.approx(np.array(later) * (1 - np.array(later)))
    assert patrols.fresh[2, 1, 0] == pytest.approx(0.0, abs=1e-9)
    assert (np.diff(patrols.fresh[2, 1]) > 0.0).all()


def test_the_first_feature_is_the_rate_of_greedy(patrols: Patrols) -> None:
    for i in range(3):
        situation = patrols.situation(i)
        found = features(situation)
        assert found.shape == (len(situation.times), FEATURES)
        expected = rates(situation)
        assert found[:, GREEDY] == pytest.approx(expected / expected.max(), abs=0.06)
        kept = patrols.fit[i]
        assert patrols.features[i][kept] == pytest.approx(found)
        assert not patrols.features[i][~kept].any()


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
