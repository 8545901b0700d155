"""The fast setting, the network's invariances, and learning from them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch

from agents.viewpoints.exponential_beliefs import ExponentialBeliefs
from agents.viewpoints.fast_patrols import BUDGET, FastPatrols
from agents.viewpoints.floors import Floors, draw_floors
from agents.viewpoints.learned import Learned, load_network, save_network
from agents.viewpoints.network import ViewpointNetwork
from agents.viewpoints.policies.greedy import Greedy
from agents.viewpoints.ppo import Learner, Settings, by_network, each, inputs_of, scores
from dynslam_env.worlds.office import Office
from slam.errors import InputError


@pytest.fixture(scope="module")
def floors() -> Floors:
    return draw_floors(Office(), "train", 0, 3)


def test_beliefs_follow_looks_and_drift_to_what_they_do_not_know() -> None:
    beliefs = ExponentialBeliefs(1, 2)
    beliefs.look(np.array([[True, False]]), np.array([[True, True]]))
    assert beliefs.closed()[0] == pytest.approx([1.0, 0.5], abs=2e-3)
    rows = beliefs.rows()
    assert rows.stale[0, 0, 0] < 0.01
    assert (np.diff(rows.stale[0, 0]) > 0.0).all()
    beliefs.advance(np.array([100.0]))
    assert 0.5 < beliefs.closed()[0, 0] < 0.9
    assert rows.age[0, 1] == np.inf
    assert beliefs.age[0, 0] == 100.0


def test_beliefs_learn_that_a_doorway_never_flips() -> None:
    beliefs = ExponentialBeliefs(1, 2)
    for k in range(40):
        flipping = bool(k % 2)
        beliefs.look(np.ones((1, 2), np.bool_), np.array([[False, flipping]]))
        beliefs.advance(np.array([60.0]))
    still, flips = beliefs.rows().fresh[0, :, -2]
    assert still < 0.05 < 0.2 < flips


def test_time_passes_as_the_table_says_and_errors_are_those_of_the_beliefs(floors: Floors) -> None:
    patrols = FastPatrols(floors, 2, np.random.default_rng(0), bare=0.0)
    places, numbers = patrols.place.copy(), patrols.floor.copy()
    error, takes, over = patrols.step(places)
    assert takes.tolist() == floors.between[numbers, places, places].tolist()
    assert (error > 0.0).all()
    assert (error <= 0.3 * takes).all()
    assert not over.any()
    seen = floors.then[numbers, places, places]
    assert (patrols.beliefs.age[seen] == 0.0).all()
    assert np.isinf(patrols.beliefs.age[~seen]).all()


def test_an_episode_ends_after_its_budget(floors: Floors) -> None:
    found = scores(floors, each([Greedy() for _ in floors.doors]), seed=0)
    assert found.shape == floors.doors.shape
    assert (found > 0.0).all()
    assert (found < 0.25).all()
    assert BUDGET == 600.0


def test_a_new_network_is_greedy(floors: Floors) -> None:
    network = ViewpointNetwork()
    both = [scores(floors, choose, seed=3) for choose in
            (by_network(network), each([Greedy() for _ in floors.doors]))]  # fmt: skip
    assert both[0] == pytest.approx(both[1])


def test_the_order_of_doors_and_viewpoints_does_not_matter(floors: Floors) -> None:
    torch.manual_seed(0)
    network = ViewpointNetwork()
    torch.nn.init.normal_(network.logit.weight)
    patrols = FastPatrols(floors, 1, np.random.default_rng(0))
    given = inputs_of(patrols.seen())
    views, doors = torch.randperm(given.fit.shape[1]), torch.randperm(given.real.shape[1])
    other = given._replace(
        doors=given.doors[:, doors], real=given.real[:, doors], views=given.views[:, views],
        sees=given.sees[:, views][:, :, doors], apart=given.apart[:, views][:, :, views],
        fit=given.fit[:, views],
    )  # fmt: skip
    with torch.no_grad():
        (logits, value), (others, same) = network(given), network(other)
    assert torch.allclose(logits[:, views], others, atol=1e-4)
    assert torch.allclose(value, same, atol=1e-4)


def test_the_same_seed_learns_the_same_policy(floors: Floors, tmp_path: Path) -> None:
    settings = Settings(patrols=4, length=4, batch=8, imitated=16)
    learners = [Learner(floors, 5, 64, settings) for _ in range(2)]
    for learner in learners:
        learner.imitate(Greedy)
        told = learner.update()
        assert told["decisions"] == 16
        assert 0.0 < told["error"] < 0.3
    for one, other in zip(*(x.network.state_dict().values() for x in learners), strict=True):
        assert torch.equal(one, other)
    save_network(learners[0].network, tmp_path / "best.npz")
    read = load_network(tmp_path / "best.npz").state_dict()
    assert all(torch.equal(read[name], x) for name, x in learners[0].network.state_dict().items())


def test_a_learned_policy_chooses_a_viewpoint_that_can_be_reached(
    floors: Floors, tmp_path: Path
) -> None:
    save_network(ViewpointNetwork(), tmp_path / "best.npz")
    patrols = FastPatrols(floors, 1, np.random.default_rng(0))
    situation = patrols.situation(0, patrols.seen())
    assert Learned(tmp_path / "best.npz").choose(situation) == Greedy().choose(situation)


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
