"""Time of the parts of a patrol's step, and of learning from it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from typing import Any

import gymnasium as gym
import numpy as np
from rich.box import HORIZONTALS
from rich.table import Table

from dynslam_env.patrol.memory import DynamicMap
from dynslam_env.patrol.patroller import Patroller
from dynslam_env.simulation.world_batch import WorldBatch
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.results import Result

from ..console.progress import ProgressTracker

WORLDS = 32
STEPS_PER_ROUND = 50  # of all worlds at once
PARTS = (
    ("world: physics, laser, odometry", WorldBatch, "step"),
    ("SLAM", MaximumLikelihood, "update"),
    ("dynamic map", DynamicMap, "look"),
    ("freshness of the cells, for the reward", DynamicMap, "freshness"),
    ("observation", Patroller, "observation"),
)


def patrol_rows(rounds: int, track: ProgressTracker) -> list[Result]:
    """The parts of a step of `DoorPatrol-v0` with WORLDS worlds in one process and random actions,
    of the fastest round; and, with dynslam[train], of learning."""
    env = gym.make_vec("DoorPatrol-v0", WORLDS, autoreset_mode="SameStep")
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    env.step(_actions(rng))  # everything is compiled
    best: list[Result] = []
    for _ in track(range(rounds), "patrol"):
        rows = _step_rows(env, rng)
        if not best or rows[-1]["step_us"] < best[-1]["step_us"]:
            best = rows
    env.close()
    return best + (_learning_rows() if find_spec("stable_baselines3") else [])


def patrol_table(rows: list[Result]) -> Table:
    """For a terminal."""
    table = Table(box=HORIZONTALS, title=f"DoorPatrol-v0, {WORLDS} worlds")
    table.add_column("what")
    for heading in ("step, us", "share, %", "steps a second"):
        table.add_column(heading, justify="right")
    for row in rows:
        share = f"{100 * row['share']:.0f}" if "share" in row else ""
        whole = f"{1e6 / row['step_us']:,.0f}" if "share" not in row else ""
        table.add_row(row["what"], f"{row['step_us']:.0f}", share, whole)
    return table


def _step_rows(env: Any, rng: np.random.Generator) -> list[Result]:
    spent: dict[str, float] = {}
    with ExitStack() as stack:
        for name, owner, method in PARTS:
            stack.enter_context(_timed(owner, method, name, spent))
        start = time.perf_counter()
        for _ in range(STEPS_PER_ROUND):
            env.step(_actions(rng))
        whole = time.perf_counter() - start
    each = 1e6 / (STEPS_PER_ROUND * WORLDS)
    rows = [_row(name, spent[name] * each, spent[name] / whole) for name, *_ in PARTS]
    rest = whole - sum(spent.values())
    rows.append(_row("the rest: rewards, doors' score, infos", rest * each, rest / whole))
    return [*rows, {"what": "a step of the environment", "step_us": whole * each}]


def _learning_rows() -> list[Result]:
    """Two rollouts of PPO as `dynslam train` makes them, with one process and with two."""
    import agents.training  # noqa: F401, I001 - first: it tells torch how to wait
    from stable_baselines3 import PPO

    from agents.training.settings import arguments, read_settings
    from agents.training.torch_setup import configure_torch, use_channels_last
    from agents.training.workers import Workers

    configure_torch()
    settings, rows = read_settings("ppo", "DoorPatrol-v0"), []
    for workers in (1, 2):
        env = Workers("DoorPatrol-v0", settings["n_envs"], workers, {})
        model = PPO(settings["policy"], env, seed=0, device="cpu", **arguments(settings))
        use_channels_last(model)
        rollout = settings["n_envs"] * settings["n_steps"]
        model.learn(rollout)  # everything is compiled
        start = time.perf_counter()
        model.learn(2 * rollout)
        each = 1e6 * (time.perf_counter() - start) / (2 * rollout)
        env.close()
        processes = "one process" if workers == 1 else f"{workers} processes"
        rows.append({"what": f"learning by PPO, {processes} for the worlds", "step_us": each})
    return rows


def _row(what: str, us: float, share: float) -> Result:
    return {"what": what, "step_us": us, "share": share}


def _actions(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(-1.0, 1.0, (WORLDS, 2)).astype(np.float32)


@contextmanager
def _timed(owner: type, method: str, name: str, spent: dict[str, float]) -> Iterator[None]:
    """Add up what calls of a method take."""
    plain = getattr(owner, method)
    spent[name] = 0.0

    def timed(*args: Any, **kwargs: Any) -> Any:
        start = time.perf_counter()
        try:
            return plain(*args, **kwargs)
        finally:
            spent[name] += time.perf_counter() - start

    setattr(owner, method, timed)
    try:
        yield
    finally:
        setattr(owner, method, plain)
