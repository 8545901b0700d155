"""The rollout oracle, by which the page of agents says what better choices would gain."""

# pyright: reportMissingImports=false

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from agents.viewpoints.floors import Floors
from agents.viewpoints.network import ViewpointNetwork
from agents.viewpoints.patrols import BUDGET, EXPLORE, Patrols
from agents.viewpoints.ppo import by_network
from docs.making.rollout_scores import Futures, Oracle, copied, driven, imagine


def test_the_true_future_is_never_worse_than_the_policy(floors: Floors) -> None:
    network, rng = ViewpointNetwork(), np.random.default_rng(0)
    usual = driven(floors, by_network(network))
    best = driven(floors, Oracle(network, Futures(4, 0, BUDGET), rng))
    assert (best <= usual + 1e-9).all()
    assert (best < usual - 1e-4).any()


def test_imagined_doors_are_as_they_are_believed_to_be(floors: Floors) -> None:
    patrols = Patrols(floors, 1, np.random.default_rng(0))
    for _ in range(6):
        patrols.step(np.array([EXPLORE]))
    before = [part.copy() for part in patrols.state]
    futures = copied(patrols, np.zeros(2000, np.int64))
    unknown = imagine(futures, np.arange(2000), 60.0)
    state, known = futures.state, np.isfinite(patrols.state.age[0])
    assert known.any()
    assert (unknown == ~known).all()
    half = state.phases.shape[-1] // 2
    believed = (state.weights[0] * state.phases[0, ..., half:].sum(axis=-1)).sum(axis=-1)
    assert state.closed[:, known].mean(axis=0) == pytest.approx(believed[known], abs=0.05)
    assert np.isinf(state.flips[:, ~known]).all()
    flips = state.flips[np.isfinite(state.flips)]
    assert (flips > patrols.state.time[0]).all()
    assert (flips < patrols.state.time[0] + 61.0).all()
    assert all((part == kept).all() for part, kept in zip(patrols.state, before, strict=True))
