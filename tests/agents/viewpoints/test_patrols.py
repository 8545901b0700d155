"""Patrols of the fast setting: time, doors, beliefs and what is seen."""

from __future__ import annotations

import numpy as np
import pytest

from agents.viewpoints.features import FEATURES, GREEDY, features
from agents.viewpoints.floors import MAX_DOORS, Floors
from agents.viewpoints.laws import laws
from agents.viewpoints.missed import DURATION
from agents.viewpoints.patrols import BUDGET, EXPLORE, HISTORIES, NEAR, Patrols, histories
from agents.viewpoints.policies.greedy import rates
from dynslam_env.patrol.dwell_laws import PHASES, DoorFilter, DwellLaws
from dynslam_env.patrol.slow_doors import SlowDoors
from dynslam_env.simulation.laws import Uniform


@pytest.fixture
def patrols(floors: Floors) -> Patrols:
    """Patrols that have explored for a while."""
    patrols = Patrols(floors, 6, np.random.default_rng(0))
    for _ in range(5):
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
        assert (state.visited.sum(axis=1) > before).all()
        known.append(np.isfinite(state.age).sum(axis=1).mean())
        if len(known) == 1:
            assert error / takes == pytest.approx(0.25, abs=0.05)
    assert (np.diff(known) >= 0.0).all()
    assert known[0] < 0.9 * patrols.floors.doors[state.floor].mean() < known[-1]


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
    assert np.abs(p - closed)[last] == pytest.approx(0.0, abs=0.05)
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
    later = state.weights[2, d] @ filter_.expected(0.0).forecast[chosen]
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
    """Of an open door after a time in sight, of a closed one at the first look."""
    state = patrols.state
    leaves = np.arange(MAX_DOORS) < patrols.floors.leaves[state.floor][:, None]
    for i in range(6):
        patrols.restart(i, i % 2)
    assert np.isinf(state.hidden[~leaves]).all()
    assert (state.hidden[leaves] > 0.0).all()
    assert np.isfinite(state.hidden[leaves]).all()
    last = patrols.floors.sights[state.floor, state.place, state.place] >= 1 << 7
    soon = np.cumsum(leaves & last).reshape(leaves.shape) % 2 == 1
    state.hidden[leaves] = np.where(soon, 0.3, 100.0)[leaves]
    state.closed[:], state.flips[:] = False, np.inf
    patrols.step(state.place.copy())  # a look around: the last of eight parts of 3 s
    assert ((state.hidden == 0.0) == (leaves & last & soon)).all()
    assert (leaves & last & ~soon).any()
    state.closed[leaves] = True
    patrols.step(state.place.copy())
    assert ((state.hidden == 0.0)[last] == leaves[last]).all()


def test_what_a_viewpoint_did_not_show_is_not_promised_for_a_while(patrols: Patrols) -> None:
    state, floors, here = patrols.state, patrols.floors, patrols.state.place.copy()
    i = int(np.argmax(floors.then[state.floor, here, here].sum(axis=1)))
    door = int(np.argmax(floors.then[state.floor[i], here[i], here[i]]))
    before = patrols.situation(i)
    shown = floors.sights.copy()
    floors.sights[state.floor[i], :, :, door] = 0
    patrols.step(here)
    floors.sights[:] = shown
    patrols.look()
    situation = patrols.situation(i)
    column = int(np.isfinite(state.age[i, :door]).sum())
    assert before.then[:, situation.last, column].any()
    assert not situation.then[:, situation.last, column].any()
    ours = features(situation)
    real = np.isfinite(floors.between[state.floor[i], 0])
    assert ours[:-1] == pytest.approx(patrols.features[i, :EXPLORE][real])
    state.time[i] += DURATION
    assert (patrols.situation(i).then == before.then).all()


def test_exploring_misses_nothing(patrols: Patrols) -> None:
    patrols.state.visited[:] = False
    patrols.floors.sights[:], kept = 0, patrols.floors.sights.copy()
    patrols.step(np.full(6, EXPLORE))
    patrols.floors.sights[:] = kept
    assert not patrols.state.missed.any()


def test_viewpoints_seen_from_near_need_no_exploring(floors: Floors) -> None:
    patrols = Patrols(floors, 1, np.random.default_rng(0))
    state, near = patrols.state, floors.reveals & (floors.between < NEAR)
    place = near[state.floor[0]].sum(axis=1).argmax()
    state.place[0] = place
    patrols.step(state.place.copy())
    seen = near[state.floor[0], place] | (np.arange(len(near[0])) == place)
    assert seen.sum() > 1
    assert (state.visited[0] == seen).all()
