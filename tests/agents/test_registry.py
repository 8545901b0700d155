"""Agents by name, by the file of a policy, and out of a user's file."""

import re
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import agents
from agents import registry
from slam import InputError

PAGE = Path(__file__).parents[2] / "docs" / "agents.md"


@pytest.fixture
def env():
    env = gym.make("DoorPatrol-v0")
    env.reset(seed=0)
    return env


@pytest.fixture
def spinner(tmp_path) -> Path:
    """The policy of docs/agents.md, in a file."""
    (block,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(block.splitlines()) <= 15
    path = tmp_path / "spinner.py"
    path.write_text(block)
    return path


def test_the_policy_of_the_page_drives(spinner, env):
    agents.check(f"{spinner}:Spinner")
    agent, total = agents.make(f"{spinner}:Spinner", env), 0.0
    observation, _ = env.reset(seed=0)
    for _ in range(20):
        action, _ = agent.predict(observation)
        observation, reward, *_ = env.step(action)
        total += float(reward)
    assert np.isfinite(total)
    assert env.get_wrapper_attr("slam").pose.x > 1.0  # it got on


@pytest.mark.parametrize("name", ["nobody", "missing.zip", "missing.py:Spinner"])
def test_who_is_not_there_is_told(name, env):
    for ask in (agents.check, lambda name: agents.make(name, env)):
        with pytest.raises(InputError, match=re.escape(name.partition(":")[0])):
            ask(name)


def test_a_file_without_it_is_told(spinner, env):
    with pytest.raises(InputError, match="'Nothing' cannot be had"):
        agents.make(f"{spinner}:Nothing", env)


def test_a_file_without_a_policy_is_told(tmp_path, env):
    pytest.importorskip("stable_baselines3")
    path = tmp_path / "bad.zip"
    path.write_bytes(b"no policy")
    for ask in (agents.check, lambda name: agents.make(name, env)):
        with pytest.raises(InputError, match="not a policy that dynslam train wrote"):
            ask(str(path))
    agents.check(str(registry.POLICIES / "ppo.zip"))


def test_a_file_that_breaks_is_told(tmp_path):
    (tmp_path / "bad.py").write_text("1 / 0\n")
    with pytest.raises(InputError, match="ZeroDivisionError"):
        agents.check(f"{tmp_path / 'bad.py'}:Spinner")


def test_the_trained_policy_is_there_and_drives(env):
    agent = agents.make("ppo", env)
    observation, _ = env.reset(seed=0)
    first, _ = agent.predict(observation)
    assert first.shape == (2,)
    assert (np.abs(first) <= 1).all()
    for _ in range(5):
        observation, *_ = env.step(first)
    later, _ = agent.predict(observation)
    assert (later != first).any()
