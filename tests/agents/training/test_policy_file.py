import base64
import io
import json
import pickle
import zipfile
from typing import Any

import numpy as np
import pytest
from stable_baselines3 import PPO

pytest.importorskip("stable_baselines3")

import torch

from agents.trained import Trained
from agents.training.policy_file import (
    TRAINING_MEMBER,
    WEIGHTS_MEMBER,
    read_policy,
    restore,
    save_model,
    write_slim,
)
from agents.training.train import ALGORITHMS
from agents.vec_env import NativeVecEnv
from dynslam_env import DoorWorldEnv
from dynslam_env.patrol.env import DoorPatrolEnv
from slam import InputError

KWARGS = {
    "ppo": "dict(net_arch=dict(pi=[8], vf=[8]))",
    "recurrent-ppo": "dict(net_arch=dict(pi=[8], vf=[8]), lstm_hidden_size=8)",
}
POLICIES = {"ppo": "MultiInputPolicy", "recurrent-ppo": "MultiInputLstmPolicy"}


def told(algorithm):
    settings = {"policy": POLICIES[algorithm], "policy_kwargs": KWARGS[algorithm]}
    return {"env": "DoorPatrol-v0", "algorithm": algorithm, "settings": settings}


@pytest.fixture(scope="module", params=ALGORITHMS)
def saved(request, tmp_path_factory) -> Any:
    """A model with weights of its own, what was told, and its file."""
    kwargs = {"net_arch": {"pi": [8], "vf": [8]}}
    if request.param != "ppo":
        kwargs["lstm_hidden_size"] = 8  # type: ignore[assignment]
    env = NativeVecEnv.make("DoorPatrol-v0", 2)
    kind: Any = ALGORITHMS[request.param]
    model = kind(POLICIES[request.param], env, seed=5, policy_kwargs=kwargs)
    path = tmp_path_factory.mktemp(request.param) / "best.zip"
    save_model(model, told(request.param), path)
    return model, told(request.param), path


def test_what_is_written_is_read(saved):
    model, expected, path = saved
    found, weights = read_policy(path)
    assert found == expected
    for name, values in model.policy.state_dict().items():
        assert torch.equal(weights[name], values), name


@pytest.mark.parametrize("times", [1, 100])
def test_few_numbers_that_become_many_are_refused(saved, tmp_path, times):
    """By a stride of 0, or in tensors that share them: 2 kB became 2.4 GB."""
    model, expected, _ = saved
    one = torch.zeros(1).expand(100_000_000 // times)
    weights = model.policy.state_dict() | {f"more{k}": one for k in range(times)}
    file, path = io.BytesIO(), tmp_path / "some.zip"
    torch.save(weights, file)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(WEIGHTS_MEMBER, file.getvalue())
        archive.writestr(TRAINING_MEMBER, json.dumps(expected))
    with pytest.raises(InputError, match="takes more memory than files of its size"):
        read_policy(path)


def test_stable_baselines3_reads_it_as_well(saved):
    model, expected, path = saved
    again = ALGORITHMS[expected["algorithm"]].load(path, device="cpu")
    for a, b in zip(model.policy.parameters(), again.policy.parameters(), strict=True):
        assert torch.equal(a, b)


def test_a_slim_one_acts_the_same_and_is_smaller(saved, tmp_path):
    _, expected, path = saved
    write_slim(path, tmp_path / "slim.zip")
    found, weights = read_policy(tmp_path / "slim.zip")
    assert found == expected
    assert all(torch.equal(weights[k], v) for k, v in read_policy(path)[1].items())
    assert (tmp_path / "slim.zip").stat().st_size < path.stat().st_size
    write_slim(path, tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == (tmp_path / "slim.zip").read_bytes()


def test_a_trained_agent_acts_as_the_model_does(saved):
    model, _, path = saved
    env = DoorPatrolEnv()
    agent = Trained(path, env)
    observation, _ = env.reset(seed=0)
    mine, theirs, start = None, None, np.ones(1, dtype=bool)
    for _ in range(8):
        action, mine = agent.predict(observation, mine, start)
        expected, theirs = model.predict(observation, theirs, start, deterministic=True)
        assert action.tobytes() == expected.tobytes()
        assert action in env.action_space
        observation, start = env.step(action)[0], np.zeros(1, dtype=bool)


def test_what_was_trained_on_other_observations_is_refused(saved):
    with pytest.raises(InputError, match="trained in DoorPatrol-v0, which has other observations"):
        Trained(saved[2], DoorWorldEnv())


class Malicious:
    """Touches a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def archive(path, **members):
    with zipfile.ZipFile(path, "w") as out:
        for name, content in members.items():
            out.writestr({"told": TRAINING_MEMBER, "weights": WEIGHTS_MEMBER}[name], content)
    return path


@pytest.mark.parametrize("way", ["torch", "pickle"])
def test_a_malicious_pickle_is_refused_and_nothing_runs(tmp_path, way):
    touched, file = tmp_path / "touched", io.BytesIO()
    if way == "torch":
        torch.save({"w": Malicious(touched)}, file)
    else:
        file.write(pickle.dumps(Malicious(touched)))
    path = archive(tmp_path / "bad.zip", told=json.dumps(told("ppo")), weights=file.getvalue())
    with pytest.raises(InputError, match=r"bad.zip: not a policy of dynslam train"):
        Trained(path, DoorPatrolEnv())
    assert not touched.exists()
    pickle.loads(pickle.dumps(Malicious(touched)))  # it would have
    assert touched.exists()


def test_files_that_are_something_else_are_refused(saved, tmp_path):
    whole = saved[2].read_bytes()
    bad = tmp_path / "bad.zip"
    for content in (b"", b"no zip", whole[: len(whole) // 2], whole[:-10]):
        bad.write_bytes(content)
        with pytest.raises(InputError, match=r"bad.zip: not a policy"):
            read_policy(bad)
    with pytest.raises(InputError, match="no such file"):
        read_policy(tmp_path / "none.zip")
    saved[0].save(bad)  # of stable-baselines3's own making: it counts as PPO
    assert read_policy(bad)[0]["env"] == "a plain file"


def pickled(value):
    file = io.BytesIO()
    torch.save(value, file)
    return file.getvalue()


@pytest.mark.parametrize(
    "wrong",
    [[], {}, told("ppo") | {"algorithm": "magic"}, told("ppo") | {"settings": {"policy": "magic"}}],
)
def test_files_that_tell_something_else_are_refused(tmp_path, wrong):
    path = archive(tmp_path / "bad.zip", told=json.dumps(wrong), weights=pickled({}))
    with pytest.raises(InputError, match=r"bad.zip"):
        Trained(path, DoorPatrolEnv())


@pytest.mark.parametrize("weights", [[1, 2], {"a": 3}, {}])
def test_files_whose_weights_are_something_else_are_refused(tmp_path, weights):
    path = archive(tmp_path / "bad.zip", told=json.dumps(told("ppo")), weights=pickled(weights))
    with pytest.raises(InputError, match=r"bad.zip"):
        Trained(path, DoorPatrolEnv())


def rewritten(path, out, **members):
    """A copy of an archive with some members of other content."""
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(out, "w", 8) as copy:
        for name in archive.namelist():
            copy.writestr(name, members.get(name.replace(".", "_"), archive.read(name)))
    return out


def in_torch_file(data, pickled):
    """A file of torch.save with another pickle in it."""
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive, zipfile.ZipFile(file, "w") as copy:
        for name in archive.namelist():
            copy.writestr(name, pickled if name.endswith("data.pkl") else archive.read(name))
    return file.getvalue()


class Harm:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


def test_resuming_runs_nothing_that_is_in_the_file(saved, tmp_path):
    """stable-baselines3 unpickles most of `data`: a foreign folder could run code."""
    model, _, path = saved
    with zipfile.ZipFile(path) as archive:
        told = json.loads(archive.read("data"))
        weights = archive.read(WEIGHTS_MEMBER)
    harm = base64.b64encode(pickle.dumps(Harm(tmp_path / "harmed"))).decode()
    told |= {name: {":type:": "x", ":serialized:": harm} for name in ("_last_obs", "policy_class")}
    told["num_timesteps"] = 96
    bad = rewritten(path, tmp_path / "bad.zip", data=json.dumps(told))
    restore(model, bad)
    assert model.num_timesteps == 96
    for pickled in (
        pickle.dumps(Harm(tmp_path / "harmed")),
        pickle.dumps(bytearray(9), protocol=2),
    ):
        member = in_torch_file(weights, pickled)
        for name in ("policy_pth", "policy_optimizer_pth"):
            bad = rewritten(path, tmp_path / "bad.zip", **{name: member})
            with pytest.raises(InputError, match=r"bad.zip: not a checkpoint to resume from \("):
                restore(model, bad)
    assert not (tmp_path / "harmed").exists()


@pytest.mark.parametrize("counts", [{"num_timesteps": -1}, {"_n_updates": "many"}, {}])
def test_a_checkpoint_without_its_counts_is_refused(saved, tmp_path, counts):
    model, _, path = saved
    with zipfile.ZipFile(path) as archive:
        told = json.loads(archive.read("data")) | counts
    told = told if counts else {}
    bad = rewritten(path, tmp_path / "bad.zip", data=json.dumps(told))
    with pytest.raises(InputError, match="not a checkpoint"):
        restore(model, bad)


def test_a_small_policy_takes_little_memory(saved, tmp_path):
    """Of 4 MB, by members that unpack to a thousand times their size; it was 6.5 GB."""
    path = saved[2]
    file = io.BytesIO()
    torch.save({"weight": torch.zeros(80_000_000)}, file)
    bad = rewritten(path, tmp_path / "bad.zip", policy_pth=file.getvalue())
    assert bad.stat().st_size < 1 << 20
    with pytest.raises(InputError, match="takes more memory than files of its size"):
        read_policy(bad)
    with pytest.raises(InputError, match="takes more memory than files of its size"):
        restore(saved[0], bad)


@pytest.mark.parametrize(
    "kwargs",
    [
        "dict(net_arch=[100000])",
        "dict(net_arch=[4096] * 3)",
        "dict(net_arch=[" + "4," * 150 + "])",
        "dict(net_arch=[4096, 4096, 4096, 4096])",
        "dict(net_arch=-1)",
        "dict(activation_fn=3)",
        "(" * 500,
    ],
)
def test_a_file_does_not_decide_on_a_huge_network(saved, tmp_path, kwargs):
    _, training, path = saved
    settings = training["settings"] | {"policy_kwargs": kwargs}
    other = json.dumps(training | {"settings": settings})
    bad = rewritten(path, tmp_path / "bad.zip", dynslam_json=other)
    with pytest.raises(InputError, match=r"bad\.zip: ") as refused:
        Trained(bad, DoorPatrolEnv())
    assert "\n" not in str(refused.value)


def test_a_plain_file_of_stable_baselines3_drives(tmp_path):
    env = NativeVecEnv.make("DoorPatrol-v0", 2)
    model = PPO("MultiInputPolicy", env, seed=3)
    model.save(tmp_path / "plain.zip")
    patrol = DoorPatrolEnv()
    observation, _ = patrol.reset(seed=0)
    action, _ = Trained(tmp_path / "plain.zip", patrol).predict(observation)
    expected, _ = model.predict(observation, deterministic=True)
    assert np.array_equal(action, expected)
