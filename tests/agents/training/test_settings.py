from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("stable_baselines3")

import yaml

import agents
from agents.training.settings import ALGORITHMS, arguments, read_settings
from agents.training.train import ALGORITHMS as CLASSES
from agents.vec_env import NativeVecEnv
from slam import InputError

OURS = Path(agents.__file__).parent / "training" / "hyperparameters"
RL_ZOO3 = {
    "n_envs", "n_timesteps", "policy", "n_steps", "batch_size", "n_epochs", "gamma", "gae_lambda",
    "learning_rate", "clip_range", "ent_coef", "vf_coef", "max_grad_norm", "policy_kwargs",
    "normalize", "target_kl", "use_sde", "sde_sample_freq",
}  # fmt: skip


def written(tmp_path, text):
    path = tmp_path / "mine.yml"
    path.write_text(text)
    return path


def test_an_entry_is_what_the_file_says(tmp_path):
    path = written(tmp_path, "A-v0:\n  n_envs: 2\n  learning_rate: lin_1e-3\nB-v0:\n  n_envs: 3\n")
    assert read_settings("ppo", "A-v0", path) == {"n_envs": 2, "learning_rate": "lin_1e-3"}
    assert read_settings("ppo", "B-v0", path) == {"n_envs": 3}


def test_an_environment_without_an_entry_is_told_with_those_that_have(tmp_path):
    path = written(tmp_path, "A-v0: {n_envs: 2}\nB-v0: {n_envs: 3}\n")
    with pytest.raises(InputError, match=r"mine.yml: nothing for 'C-v0'; there is A-v0, B-v0"):
        read_settings("ppo", "C-v0", path)
    with pytest.raises(InputError, match="nothing for 'C-v0'; there is DoorPatrol-v0"):
        read_settings("ppo", "C-v0")


@pytest.mark.parametrize("text", ["A-v0: [", "\t: x", "!!python/object/apply:os.getcwd []"])
def test_what_is_no_yaml_is_told(tmp_path, text):
    with pytest.raises(InputError, match=r"mine.yml: not YAML"):
        read_settings("ppo", "A-v0", written(tmp_path, text))


@pytest.mark.parametrize("text", ["", "17", "- A-v0", "A-v0: 17", "A-v0:"])
def test_what_holds_no_entries_is_told(tmp_path, text):
    with pytest.raises(InputError, match=r"mine.yml: .*'A-v0'"):
        read_settings("ppo", "A-v0", written(tmp_path, text))


def test_a_linear_schedule_falls_to_zero():
    given = arguments({"learning_rate": "lin_4e-4", "clip_range": 0.2})
    schedule = given["learning_rate"]
    assert [schedule(left) for left in (1.0, 0.5, 0.0)] == pytest.approx([4e-4, 2e-4, 0.0])
    assert given["clip_range"] == 0.2


@pytest.mark.parametrize("text", ["fast", "lin_", "lin_fast", "log_1e-3"])
def test_another_schedule_is_refused(text):
    with pytest.raises(InputError, match=r"learning_rate is a number, or lin_NUMBER, got"):
        arguments({"learning_rate": text})


def test_policy_kwargs_are_read():
    text = "dict(log_std_init=-0.5, shared_lstm=True, net_arch=dict(pi=[64, 32], vf=[]), n=None)"
    assert arguments({"policy_kwargs": text})["policy_kwargs"] == {
        "log_std_init": -0.5,
        "shared_lstm": True,
        "net_arch": {"pi": [64, 32], "vf": []},
        "n": None,
    }


@pytest.mark.parametrize(
    "text",
    [
        "__import__('pathlib').Path('{here}').touch()",
        "dict(a=__import__('pathlib').Path('{here}').touch())",
        "dict(a=open('{here}', 'w'))",
        "dict(**open('{here}', 'w').__dict__)",
        "dict(activation_fn=nn.ReLU)",
        "dict(a=[x for x in (1, 2)])",
        "dict(a=1",
        "import os",
    ],
)
def test_of_policy_kwargs_nothing_is_run(tmp_path, text):
    here = tmp_path / "touched"
    with pytest.raises(InputError, match=r"policy_kwargs is dict\(name=value, ...\), got"):
        arguments({"policy_kwargs": text.format(here=here)})
    assert not here.exists()


@pytest.mark.parametrize("text", ["dict(1)", "dict([('a', 2)])", "dict(**{'a': 1})", "[1, 2]", "3"])
def test_policy_kwargs_of_another_form_are_refused_rather_than_lost(text):
    with pytest.raises(InputError, match="policy_kwargs is dict"):
        arguments({"policy_kwargs": text})


def test_what_is_given_is_left_as_it_is():
    settings = {
        "policy": "P",
        "n_envs": 2,
        "n_timesteps": 9,
        "learning_rate": "lin_1",
        "gamma": 0.9,
    }
    before = dict(settings)
    assert set(arguments(settings)) == {"learning_rate", "gamma"}
    assert settings == before


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_our_own_are_what_rl_zoo3_reads(algorithm):
    for entry in yaml.safe_load((OURS / f"{algorithm}.yml").read_text()).values():
        assert set(entry) <= RL_ZOO3
        assert all(isinstance(value, int | float | str) for value in entry.values())
        assert eval(entry["policy_kwargs"]) == arguments(entry)["policy_kwargs"]  # as rl_zoo3 does
        assert entry["n_envs"] * entry["n_steps"] % entry["batch_size"] == 0


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_an_algorithm_takes_our_own(algorithm):
    settings = read_settings(algorithm, "DoorPatrol-v0")
    env = NativeVecEnv.make("DoorPatrol-v0", settings["n_envs"])
    kind: Any = CLASSES[algorithm]
    model = kind(settings["policy"], env, **arguments(settings))
    assert model.n_steps == settings["n_steps"]
    assert set(CLASSES) == set(ALGORITHMS)
