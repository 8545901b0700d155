"""Agents by name, by the file of a policy, and out of a user's file."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import agents
from agents import registry
from slam import InputError

PAGE = Path(__file__).parents[2] / "docs" / "agents.md"


def blocks() -> list[str]:
    """The Python of docs/agents.md."""
    return re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def env():
    env = gym.make("DoorPatrol-v0")
    env.reset(seed=0)
    return env


@pytest.fixture
def spinner(tmp_path) -> Path:
    """The policy of docs/agents.md, in a file."""
    (block,) = (text for text in blocks() if "class Spinner" in text)
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
    with pytest.raises(InputError, match="'Nothing' cannot be loaded"):
        agents.make(f"{spinner}:Nothing", env)


def test_a_file_without_a_policy_is_told(tmp_path, env):
    pytest.importorskip("stable_baselines3")
    path = tmp_path / "bad.zip"
    path.write_bytes(b"no policy")
    for ask in (agents.check, lambda name: agents.make(name, env)):
        with pytest.raises(InputError, match="not a policy of dynslam train"):
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


class Still:
    """An agent of one's own: it stands still."""

    def __init__(self, env, seed):
        self.seed = seed

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.zeros(2, np.float32), state


@pytest.fixture
def still(monkeypatch):
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    agents.register("still", Still)


def test_an_agent_of_ones_own_is_known_by_name(still, env):
    assert agents.names()[-1] == "still"
    agents.check("still")
    agent = agents.make("still", env, 7)
    assert isinstance(agent, Still)
    assert agent.seed == 7


@pytest.mark.parametrize(
    ("name", "builder", "told"),
    [
        ("lookout", Still, "dynslam's own agents"),
        ("", Still, "no spaces, commas or colons"),
        ("a b", Still, "no spaces, commas or colons"),
        ("a,b", Still, "no spaces, commas or colons"),
        ("a.py:b", Still, "no spaces, commas or colons"),
        ("mine", 3, "is called with"),
    ],
)
def test_what_cannot_be_registered_is_refused(still, name, builder, told):
    with pytest.raises(InputError, match=told):
        agents.register(name, builder)
    assert name not in registry._BUILDERS or name == "lookout"


def test_an_unknown_name_is_answered_with_the_nearest(env):
    with pytest.raises(InputError, match=r"unknown agent 'lookuot'; did you mean lookout\?"):
        agents.make("lookuot", env)
    with pytest.raises(InputError, match=r"unknown agent 'nobody'; known: random, scripted-path"):
        agents.check("nobody")


def test_an_installed_package_brings_its_agent(tmp_path):
    distribution = tmp_path / "theirs-1.0.dist-info"
    distribution.mkdir()
    (distribution / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (distribution / "entry_points.txt").write_text(
        "[dynslam.agents]\ntheirs = theirs:Theirs\nbroken = nowhere:build\n"
    )
    (tmp_path / "theirs.py").write_text("class Theirs:\n    def __init__(self, env, seed): pass\n")
    code = (f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import agents; "
            f"print(agents.names()[-1], type(agents.make('theirs', None)).__name__)")  # fmt: skip
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["theirs", "Theirs"]
    assert "dynslam.agents 'broken' (nowhere:build): No module named 'nowhere'" in run.stderr


def test_the_pages_code_for_stable_baselines3_loads_the_policy_in_the_repository(env):
    pytest.importorskip("stable_baselines3")
    (block,) = (text for text in blocks() if "PPO" in text)
    names: dict[str, Any] = {}
    exec(block, names)
    observation, _ = env.reset(seed=0)
    agent = agents.make("ppo", env)
    for _ in range(5):
        mine, _ = names["model"].predict(observation, deterministic=True)
        theirs, _ = agent.predict(observation)
        np.testing.assert_array_equal(mine, theirs)
        observation, *_ = env.step(mine)


def test_ppo_is_the_trained_policy_of_each_patrol() -> None:
    made = []
    for name in ("DoorPatrol-v0", "DoorPatrol-v1"):
        env = gym.make(name)
        observation, _ = env.reset(seed=0)
        agent = agents.make("ppo", env)
        action, _ = agent.predict(observation)
        assert env.action_space.contains(np.asarray(action, np.float32))
        made.append(type(agent).__name__)
    assert made == ["Trained", "GoalAgent"]


def test_a_trained_agent_without_torch_is_refused_before_it_is_driven(monkeypatch) -> None:
    registry.check("ppo")
    monkeypatch.setitem(sys.modules, "agents.trained", None)  # as an import that fails
    with pytest.raises(InputError, match=r"install dynslam\[train\]"):
        registry.check("ppo")
    registry.check("greedy")
