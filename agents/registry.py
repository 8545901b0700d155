"""Agents by name, and trained ones by the file of their policy."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium as gym
import numpy as np

from agents.goal_choosers.doors import DoorChooser, LongestUnseen, RoundRobin
from agents.goal_choosers.frontiers import ExploreLite, FrontierChooser, nearest
from agents.goal_choosers.goal_agent import GoalAgent, GoalChooser
from agents.goal_choosers.information import InformationChooser, laser_of, with_pose
from agents.goal_choosers.lookout import LookoutChooser
from agents.goal_choosers.oracle import OracleChooser, TrueDoors
from agents.path_patrol import PathPatrol
from agents.random_agent import RandomAgent
from agents.wall_follower import WallFollower
from dynslam_env.navigation.site import PatrolView
from dynslam_env.record import Driver
from slam.errors import InputError

Env = gym.Env[Any, Any]
ALLOWED = "allowed are a policy's file, FILE.py:NAME, and"
POLICIES = Path(__file__).parent / "policies"
"""What was trained for the project; its card is docs/agents.md."""


def names() -> list[str]:
    """The names that `make` knows."""
    return list(_AGENTS)


def make(name: str, env: Env, seed: int = 0) -> Driver:
    """The agent `name` for the episode that `env` has begun; a new episode needs a new one.

    name  one of `names()`; the file of a policy that `dynslam train` wrote (best.zip); or
          FILE.py:NAME, where NAME is a class or function (env, seed) -> agent in that file
    env   a patrol environment after `reset`; its `unwrapped` is the `PatrolView`, and its
          `unwrapped.place` is the world: "scripted-path" is shown the path of its layout, "oracle"
          its layout and doors, and no other agent anything of it
    seed  of the agent's own randomness: the same seed, the same actions

    Raises InputError for an unknown name.
    """
    if name in _AGENTS:
        return _AGENTS[name](env, seed)
    path, _, attribute = name.rpartition(":")
    if path.endswith(".py"):
        return _from_file(Path(path), attribute)(env, seed)
    if Path(name).is_file():
        return _trained(Path(name), env)
    raise InputError(f"unknown agent {name!r}; {ALLOWED} {', '.join(names())}")


def check(name: str) -> None:
    """Raises InputError where `make` would for want of such an agent, or of a policy in its file;
    takes no environment."""
    path, _, attribute = name.rpartition(":")
    if name in _AGENTS:
        return
    if path.endswith(".py"):
        _from_file(Path(path), attribute)
    elif Path(name).is_file():
        _training().read_policy(Path(name))
    else:
        raise InputError(f"unknown agent {name!r}; {ALLOWED} {', '.join(names())}")


def _from_file(path: Path, attribute: str) -> Callable[[Env, int], Driver]:
    """What is called `attribute` in a Python file: (env, seed) -> agent."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise InputError(f"{path}: a Python file that holds {attribute!r} was expected")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        return getattr(module, attribute)
    except Exception as error:  # whatever is wrong with a user's file
        raise InputError(f"{path}: {attribute!r} cannot be had ({error!r})") from None


def _trained(path: Path, env: Env) -> Driver:
    return _training().Trained(path, env)


def _training() -> ModuleType:
    try:
        from agents import trained
    except ImportError as error:
        raise InputError(f"a trained agent needs {error.name}: install dynslam[train]") from None
    return trained


def _chooser(
    choice: Callable[[PatrolView, np.random.Generator], GoalChooser],
) -> Callable[[Env, int], Driver]:
    def build(env: Env, seed: int) -> Driver:
        site: Any = env.unwrapped
        ours, recovery = np.random.SeedSequence(seed).spawn(2)
        return GoalAgent(site, choice(site, np.random.default_rng(ours)), recovery)

    return build


def _random(env: Env, seed: int) -> Driver:
    return RandomAgent(env.unwrapped.action_space, seed)


def _scripted_path(env: Env, seed: int) -> Driver:
    site: Any = env.unwrapped
    return PathPatrol(site, site.place.layout.path, seed)


def _wall_follower(env: Env, seed: int) -> Driver:
    site: Any = env.unwrapped
    return WallFollower(site, seed)


def _oracle(env: Env, seed: int) -> Driver:
    site: Any = env.unwrapped
    return GoalAgent(site, OracleChooser(TrueDoors(site.place)), seed)


_AGENTS: dict[str, Callable[[Env, int], Driver]] = {
    "random": _random,
    "scripted-path": _scripted_path,
    "wall-follower": _wall_follower,
    "nearest-frontier": _chooser(lambda site, rng: FrontierChooser(nearest)),
    "frontier": _chooser(lambda site, rng: FrontierChooser(ExploreLite())),
    "information-gain": _chooser(lambda site, rng: InformationChooser(rng, laser_of(site))),
    "information-gain-pose": _chooser(with_pose),
    "round-robin": _chooser(lambda site, rng: DoorChooser(RoundRobin())),
    "longest-unseen": _chooser(lambda site, rng: DoorChooser(LongestUnseen())),
    "lookout": _chooser(lambda site, rng: LookoutChooser(rng, site.scan.max_range)),
    "oracle": _oracle,
    "ppo": lambda env, seed: _trained(POLICIES / "ppo.zip", env),
}
