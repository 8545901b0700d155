"""Learning to choose viewpoints in the fast setting."""

# pyright: reportMissingImports=false

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch

from agents.viewpoints import train as training
from agents.viewpoints.features import SHORT_SIGHTED, features
from agents.viewpoints.floors import Floors
from agents.viewpoints.learned import Learned, load_network, save_network
from agents.viewpoints.network import EXPLORED, ViewpointNetwork
from agents.viewpoints.patrols import BUDGET, EXPLORE, Patrols
from agents.viewpoints.policies.stand import Stand
from agents.viewpoints.ppo import (
    Learner,
    Settings,
    by_feature,
    by_network,
    by_policies,
    inputs_of,
    scores,
)
from agents.viewpoints.train import Reporter, ViewpointTraining, train
from slam.errors import InputError

SMALL = Settings(patrols=4, length=4, updates=2, batch=8, judging=16)


def test_a_new_network_explores_and_then_chooses_by_saved_error(floors: Floors) -> None:
    tenth = EXPLORED[0] + EXPLORED[1] * 0.1
    assert tenth == pytest.approx(1.0)  # as much as the best viewpoint
    both = [scores(floors, choose, seed=3) for choose in
            (by_network(ViewpointNetwork()), by_feature(SHORT_SIGHTED, 0.1 * BUDGET))]  # fmt: skip
    assert both[0] == pytest.approx(both[1])
    assert (both[0] > 0.0).all()
    assert (both[0] < 0.3).all()


def test_policies_drive_in_the_fast_setting(floors: Floors) -> None:
    found = scores(floors, by_policies([Stand() for _ in range(4)]), seed=0, episodes=2)
    assert found.shape == (4,)
    assert (found < 0.3).all()


def test_the_order_of_viewpoints_does_not_matter(floors: Floors) -> None:
    torch.manual_seed(0)
    network = ViewpointNetwork()
    torch.nn.init.normal_(network.logit.weight)
    given = inputs_of(Patrols(floors, 1, np.random.default_rng(0)))
    order = torch.randperm(given.fit.shape[1])
    other = given._replace(views=given.views[:, order], fit=given.fit[:, order])
    with torch.no_grad():
        (logits, value), (others, same) = network(given), network(other)
    assert torch.allclose(logits[:, order], others, atol=1e-4)
    assert torch.allclose(value, same, atol=1e-4)


def test_it_learns_to_stay_where_that_pays(floors: Floors) -> None:
    """A reward for staying, in the place of the doors', is found within 20 rollouts."""
    settings = Settings(patrols=16, length=16, updates=20, batch=64, judging=256, rate=3e-3)
    learner = Learner(floors, 0, 10**6, settings)
    step, stayed = Patrols.step, []

    def paid(self: Patrols, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        stay = actions == self.state.place
        stayed.append(stay.mean())
        _, takes, over = step(self, actions)
        return np.where(stay, 0.0, takes), takes, over

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Patrols, "step", paid)
        learner.segment()
    assert np.mean(stayed[-16:]) > np.mean(stayed[:16]) + 0.2


def test_a_learned_policy_chooses_as_its_network(floors: Floors, tmp_path: Path) -> None:
    save_network(ViewpointNetwork(), tmp_path / "best.npz")
    patrols = Patrols(floors, 1, np.random.default_rng(0))
    for _ in range(4):
        patrols.step(np.array([EXPLORE]))
    patrols.look()
    situation, learned = patrols.situation(0), Learned(tmp_path / "best.npz")
    situation.time = 0.0
    assert learned.choose(situation) == len(situation.times)  # to explore
    situation.time = BUDGET
    assert learned.choose(situation) == features(situation)[:, SHORT_SIGHTED].argmax()


class Interrupted(Reporter):
    """Ends a training within its second segment."""

    def decisions(self, count: int) -> None:
        if count > SMALL.segment:
            raise KeyboardInterrupt


@pytest.fixture
def drawn(floors: Floors, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training, "draw_floors", lambda *given: floors)


@pytest.mark.usefixtures("drawn")
def test_a_resumed_training_equals_an_uninterrupted_one(tmp_path: Path) -> None:
    wanted = ViewpointTraining(seed=5, steps=3 * SMALL.segment, settings=SMALL)
    train(wanted, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        train(wanted, tmp_path / "cut", told=Interrupted())
    train(wanted, tmp_path / "cut", resume=True)
    for name in ("progress.jsonl", "config.json"):
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "cut" / name).read_bytes()
    for name in ("checkpoint.npz", "best.npz"):
        whole, cut = (np.load(tmp_path / folder / name) for folder in ("whole", "cut"))
        assert whole.files == cut.files
        assert all((whole[part] == cut[part]).all() for part in whole.files)
    with pytest.raises(InputError, match="holds a training: continue it by --resume"):
        train(wanted, tmp_path / "cut")
    with pytest.raises(InputError, match="seed is 5 there, not 6"):
        train(ViewpointTraining(seed=6, settings=SMALL), tmp_path / "cut", resume=True)
    np.savez(tmp_path / "cut" / "checkpoint.npz", counts=np.zeros(2))
    with pytest.raises(InputError, match=r"checkpoint.npz: not a checkpoint of viewpoints"):
        train(wanted, tmp_path / "cut", resume=True)


def test_other_files_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "other.npz", weights=np.zeros(3))
    (tmp_path / "cut.npz").write_bytes((tmp_path / "other.npz").read_bytes()[:100])
    save_network(ViewpointNetwork(), tmp_path / "nan.npz")
    with np.load(tmp_path / "nan.npz") as stored:
        weights = {name: stored[name] * np.nan for name in stored.files}
    np.savez(tmp_path / "nan.npz", **weights)
    for name in ("other", "cut", "nan"):
        with pytest.raises(InputError, match=f"{name}.npz: not the weights of a viewpoint policy"):
            load_network(tmp_path / f"{name}.npz")
