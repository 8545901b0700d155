"""The work of `dynslam endure`: random actions, and checks after every step."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
from rich.box import HORIZONTALS
from rich.console import Console
from rich.table import Table

from dynslam_env import WORLDS, DoorWorldEnv
from dynslam_env.worlds.clearance import any_crossing
from slam.geometry import Array
from slam.validation import whole_number

from ..console.exits import EXIT_FOUND
from ..console.process_memory import resident_mb
from ..console.progress import progress_bar

if TYPE_CHECKING:
    from .endure import EndureCommand

STEPS_PER_ACTION = 12  # steps for which a random action is held, so that the robot covers ground
MAX_GROWTH = 50.0  # MB
MAX_STEP_TIME = 0.5  # s, far above the delays of a busy machine; except for the first steps
COMPILING_STEPS = 10  # the first steps may compile kernels
WARM_UP_SHARE = 0.3  # of the steps, after which memory must have stopped growing


def run_random_drives(options: EndureCommand) -> int:
    """Drive, and print; the exit status is 1 if anything was found."""
    whole_number("steps", options.steps, len(WORLDS))
    whole_number("seed", options.seed, 0)
    steps = options.steps // len(WORLDS)
    with progress_bar() as bar:
        drives = []
        for name in WORLDS:
            task = bar.add_task(name, total=steps)
            advance = partial(bar.advance, task)
            drives.append(drive(name, steps, options.seed, advance))
    if options.json:
        print(json.dumps([asdict(one) for one in drives]))
    else:
        Console().print(_table(drives))
    return EXIT_FOUND if any(one.found for one in drives) else 0


@dataclass
class RandomDrive:
    """The outcome in one world: steps, episodes, ms of a step, growth of memory in MB, findings."""

    world: str
    steps: int
    episodes: int
    median_ms: float
    slowest_ms: float
    growth_mb: float
    found: list[str]


def drive(name: str, steps: int, seed: int, advance: Callable[[int], None]) -> RandomDrive:
    """Drive `steps` random steps in the environment `name`, episode after episode."""
    env = gym.make(name)
    world = env.unwrapped
    assert isinstance(world, DoorWorldEnv)
    rng, found, episodes = np.random.default_rng(seed), set(), 1
    env.reset(seed=seed)
    action, took = np.zeros(2, dtype=np.float32), np.empty(steps)
    memory, places = 0.0, _places(world)
    for i in range(steps):
        if i % STEPS_PER_ACTION == 0:
            action = rng.uniform(-1.0, 1.0, 2).astype(np.float32)
        start = time.perf_counter()
        observation, reward, terminated, truncated, _ = env.step(action)
        took[i] = time.perf_counter() - start
        found |= _wrong(observation, float(reward), world)
        found |= {"a body has gone through a wall"} if _crossed(places, world) else set()
        places = _places(world)
        if i == int(WARM_UP_SHARE * steps):
            memory = resident_mb()
        if terminated or truncated:
            env.reset()
            places = _places(world)
            episodes += 1
        if i % 1000 == 999:
            advance(1000)
    growth = resident_mb() - memory
    if growth > MAX_GROWTH:
        found.add(f"memory grew by {growth:.0f} MB")
    if took[COMPILING_STEPS:].max(initial=0.0) > MAX_STEP_TIME:
        found.add(f"a step took {took[COMPILING_STEPS:].max():.1f} s")
    median, slowest = np.median(took) * 1e3, took[COMPILING_STEPS:].max(initial=0.0) * 1e3
    return RandomDrive(name, steps, episodes, median, slowest, growth, sorted(found))


def _places(world: DoorWorldEnv) -> Array:
    """(b, 2) positions of the robot and the people, m."""
    return np.vstack([world.physics.robot[:2], world.physics.people])


def _crossed(before: Array, world: DoorWorldEnv) -> bool:
    """Whether a centre of the robot or people, at `before` (b, 2) m a step ago, crossed a wall."""
    return bool(any_crossing(np.hstack([before, _places(world)]), world.layout.walls))


def _wrong(observation: dict[str, Any], reward: float, world: DoorWorldEnv) -> set[str]:
    """Findings: states that must never occur."""
    wrong = set()
    bodies = world.physics.bodies
    if not (np.isfinite(bodies).all() and np.isfinite(reward)):
        wrong.add("a body's state or a reward is no number")
    if observation not in world.observation_space:
        wrong.add("an observation is outside its space")
    ends, places = world.layout.walls.reshape(-1, 2), _places(world)
    if (places < ends.min(axis=0)).any() or (places > ends.max(axis=0)).any():
        wrong.add("a body has left the world")
    return wrong


def _table(drives: list[RandomDrive]) -> Table:
    table = Table(box=HORIZONTALS, title="random drives", pad_edge=False)
    table.add_column("world", no_wrap=True, min_width=21)
    for heading in ("steps", "resets", "ms", "worst ms", "+ MB"):
        table.add_column(heading, justify="right")
    table.add_column("found")
    for one in drives:
        table.add_row(
            one.world, f"{one.steps:,}", f"{one.episodes:,}", f"{one.median_ms:.3f}",
            f"{one.slowest_ms:.1f}", f"{one.growth_mb:+.1f}", "; ".join(one.found) or "nothing",
        )  # fmt: skip
    return table
