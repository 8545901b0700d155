"""Agents by name: name -> builder. Users add theirs with `register` or an entry point.

A package that declares an entry point of the group `dynslam.agents`, its name the agent's and its
object an `AgentBuilder`, makes it known to every command without an import.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium as gym
import numpy as np

from agents.goal_choosers.doors import DoorChooser, LongestUnseen, RoundRobin
from agents.goal_choosers.frontiers import ExploreLite, FrontierChooser, nearest
from agents.goal_choosers.goal_agent import GoalAgent, GoalChooser
from agents.goal_choosers.information import InformationChooser
from agents.goal_choosers.lookout import LookoutChooser
from agents.goal_choosers.oracle import OracleChooser, door_truth
from agents.goal_choosers.pose_information import PoseInformation
from agents.path_patrol import PathPatrol
from agents.random_agent import RandomAgent
from agents.viewpoints.chooser import EXPLORE_TIME, ViewpointChooser
from agents.viewpoints.policies.greedy import Greedy
from agents.viewpoints.policies.look_ahead import LookAhead
from agents.viewpoints.policies.monte_carlo_entropy import MonteCarloEntropy
from agents.viewpoints.policies.stand import Stand
from agents.viewpoints.policies.tour import Tour
from agents.viewpoints.policies.whittle import Whittle
from agents.viewpoints.situation import ViewpointPolicy
from agents.viewpoints.truth import TrueBeliefs
from agents.wall_follower import WallFollower
from dynslam_env.patrol.long_env import LongPatrolEnv
from dynslam_env.record import Driver
from slam.errors import InputError
from slam.io.python_file import load_object, names_object
from slam.plugins import load_entry_points
from slam.scan import Scan
from slam.validation import unknown_name

Env = gym.Env[Any, Any]
AgentBuilder = Callable[[Env, int], Driver]
"""Builds an agent for an environment after its `reset`, from the environment and a seed; a class
whose constructor takes these two is one."""

FORMS = "or a policy's file, or FILE.py:NAME"
WEIGHTS_SUFFIX = ".npz"  # of the weights of a policy that chooses viewpoints
PATROL_REPLAN = 2.0  # s, between two plans of an agent that drives to viewpoints
POLICIES = Path(__file__).parent / "policies"
"""Policies that were trained for the project; described in docs/agents.md."""


def register(name: str, builder: AgentBuilder) -> None:
    """Register `builder` as `name` in this process; an entry point does so in every process."""
    if not name or any(c.isspace() or c in ",:" for c in name):
        raise InputError(f"an agent's name has no spaces, commas or colons, got {name!r}")
    if name in BUILDERS:
        raise InputError(f"{name!r} is one of dynslam's own agents; choose another name")
    if not callable(builder):
        raise InputError(f"an agent's builder is called with (env, seed), got {builder!r}")
    _BUILDERS[name] = builder


def names() -> list[str]:
    """The names of all registered agents, in the order of their registration."""
    _discover()
    return list(_BUILDERS)


def make(name: str, env: Env, seed: int = 0) -> Driver:
    """A new agent for the episode that `env` has begun; every episode needs a new agent.

    name  one of `names()`; the file of a policy that `dynslam train` wrote (best.zip, or best.npz
          of viewpoints), or that stable-baselines3's PPO saved with the usual MultiInputPolicy; or
          FILE.py:NAME, where NAME is an `AgentBuilder` in that file
    env   a patrol environment after `reset`. Its `unwrapped` is the `PatrolView`; of its
          `unwrapped.place`, the true world, is read by "scripted-path" (the path of the layout)
          and "oracle" (the doors) only
    seed  of the agent's random generator: the same seed gives the same actions

    Raises InputError for an unknown name.
    """
    return builder_of(name)(env, seed)


def check(name: str) -> None:
    """Check a name as `make` does, without an environment: raises InputError for an unknown name, a
    wrong file, or a trained agent without what it needs."""
    path = Path(name)
    if name in names() and builder_of(name) is _ppo:
        _training()
    elif name not in names() and not names_object(name) and path.is_file():
        if path.suffix == WEIGHTS_SUFFIX:
            _learned().load_network(path)
        else:
            _training().read_policy(path)
    else:
        builder_of(name)


def builder_of(name: str) -> AgentBuilder:
    """The builder of the agent `name`; raises InputError for an unknown one."""
    if name in _BUILDERS or name in names():
        return _BUILDERS[name]
    if names_object(name):
        return load_object(name)
    path = Path(name)
    if path.is_file() and path.suffix == WEIGHTS_SUFFIX:
        return _patrol(lambda rng: _learned().Learned(path), explored=0.0)
    if path.is_file():
        return lambda env, seed: _training().Trained(path, env)
    raise InputError(f"{unknown_name('agent', name, names())} ({FORMS})")


@cache
def _discover() -> None:
    """Register the entry points of all installed packages, once; registered names are kept."""
    load_entry_points("dynslam.agents", _BUILDERS.__contains__, register)


def _training() -> ModuleType:
    return _needs_torch("agents.trained")


def _learned() -> ModuleType:
    return _needs_torch("agents.viewpoints.learned")


def _needs_torch(module: str) -> ModuleType:
    try:
        return import_module(module)
    except ImportError as error:
        raise InputError(f"a trained agent needs {error.name}: install dynslam[train]") from None


def _goal_agent(chooser: Callable[[Scan, np.random.Generator], GoalChooser]) -> AgentBuilder:
    """A `GoalAgent`; its chooser is made from the first scan and a generator."""

    def build(env: Env, seed: int) -> Driver:
        view: Any = env.unwrapped
        choices, recoveries = np.random.SeedSequence(seed).spawn(2)
        chosen = chooser(view.snapshot().scan, np.random.default_rng(choices))
        return GoalAgent(view, chosen, recoveries)

    return build


def _patrol(
    policy: Callable[[np.random.Generator], ViewpointPolicy], explored: float = EXPLORE_TIME
) -> AgentBuilder:
    """A `GoalAgent` that explores for `explored` s, and drives to the viewpoints of a policy, which
    gets a generator."""

    def build(env: Env, seed: int) -> Driver:
        view: Any = env.unwrapped
        choices, recoveries = np.random.SeedSequence(seed).spawn(2)
        chosen = policy(np.random.default_rng(choices))
        chooser = ViewpointChooser(chosen, explored=explored)
        return GoalAgent(view, chooser, recoveries, PATROL_REPLAN)

    return build


def _knowing(policy: Callable[[], ViewpointPolicy]) -> AgentBuilder:
    """The same with the true doors, as a reference."""

    def build(env: Env, seed: int) -> Driver:
        view: Any = env.unwrapped
        chooser = ViewpointChooser(policy(), TrueBeliefs(view))
        return GoalAgent(view, chooser, seed, PATROL_REPLAN)

    return build


def _random(env: Env, seed: int) -> Driver:
    return RandomAgent(env.unwrapped.action_space, seed)


def _scripted_path(env: Env, seed: int) -> Driver:
    view: Any = env.unwrapped
    return PathPatrol(view, view.place.layout.path, seed)


def _wall_follower(env: Env, seed: int) -> Driver:
    view: Any = env.unwrapped
    return WallFollower(view, seed)


def _oracle(env: Env, seed: int) -> Driver:
    view: Any = env.unwrapped
    return GoalAgent(view, OracleChooser(lambda: door_truth(view.place)), seed)


def _ppo(env: Env, seed: int) -> Driver:
    """The trained policy of the environment: it chooses viewpoints, or velocities."""
    if isinstance(env.unwrapped, LongPatrolEnv):
        return builder_of(str(POLICIES / "viewpoints.npz"))(env, seed)
    return _training().Trained(POLICIES / "ppo.zip", env)


BUILDERS: dict[str, AgentBuilder] = {
    "random": _random,
    "scripted-path": _scripted_path,
    "wall-follower": _wall_follower,
    "nearest-frontier": _goal_agent(lambda scan, rng: FrontierChooser(nearest)),
    "frontier": _goal_agent(lambda scan, rng: FrontierChooser(ExploreLite())),
    "information-gain": _goal_agent(lambda scan, rng: InformationChooser(rng, scan)),
    "information-gain-pose": _goal_agent(
        lambda scan, rng: InformationChooser(rng, scan, PoseInformation())
    ),
    "round-robin": _goal_agent(lambda scan, rng: DoorChooser(RoundRobin())),
    "longest-unseen": _goal_agent(lambda scan, rng: DoorChooser(LongestUnseen())),
    "lookout": _goal_agent(lambda scan, rng: LookoutChooser(rng, scan.max_range)),
    "oracle": _oracle,
    "ppo": _ppo,
    "stand": _patrol(lambda rng: Stand()),
    "tour": _patrol(lambda rng: Tour()),
    "greedy": _patrol(lambda rng: Greedy()),
    "whittle": _patrol(lambda rng: Whittle()),
    "monte-carlo-entropy": _patrol(MonteCarloEntropy),
    "look-ahead": _patrol(lambda rng: LookAhead()),
    "best-place": _knowing(Stand),
    "planning-oracle": _knowing(LookAhead),
}
"""The built-in agents."""

_BUILDERS = dict(BUILDERS)
