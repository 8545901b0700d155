"""Time of a step of the environment, beside the time of its physics alone."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from statistics import median
from typing import Any

import gymnasium as gym
import numpy as np
from rich.box import HORIZONTALS
from rich.table import Table

from dynslam_env import Corridor, DoorWorldEnv, DoorWorldVectorEnv, Laser, Layout, SlamWrapper
from dynslam_env.simulation.bodies import Bodies
from dynslam_env.simulation.chipmunk import BodyStates
from dynslam_env.simulation.mechanics import Mechanics
from dynslam_env.simulation.world import PHYSICS_DT, World
from slam.benchmark.results import Result

from ..console.progress import ProgressTracker

BEAMS = (91, 181, 361, 1081)
DOORS = (0, 8, 20, 50, 200)
EXTRA_WALLS = (0, 100, 300, 1000)
THREADS = (1, 2)
STEPS_PER_ROUND = 640  # of an environment
VECTOR_STEPS_PER_ROUND = 1920  # of all worlds together
WARM_UP_STEPS = 50  # of each world
SLAM_STEPS_PER_ROUND = 160  # of one with a SLAM
CROP = 4.0  # m, side of the map that a robot observes
RESETS = (
    "DoorCorridor-v0", "DoorCorridorStatic-v0", "DoorLoop-v0", "DoorOffice-v0", "DoorCrowd-v0",
    "DoorWings-v0", "DoorPatrol-v0", "DoorPatrol-v1", "DoorPatrolGoals-v0",
)  # fmt: skip
RESETS_PER_ROUND = 20


def env_rows(num_envs: int, rounds: int, track: ProgressTracker) -> list[Result]:
    """Time of a step and of its floor for each case, and of resets.

    The floor is the time of the ten calls of pymunk's `Space.step` in a step, measured on a twin in
    the same worlds on the same drive, alternating in each round. That of `SlamWrapper` with
    `map_crop` is the time of its step without. The ratio is the median over the rounds, times are
    of the fastest round. Each world has its space of pymunk (1 ms, once an episode) before.
    """
    return [case(rounds) for case in track(list(_cases(num_envs)), "environment")]


def env_table(rows: list[Result]) -> Table:
    """The table for a terminal."""
    table = Table(box=HORIZONTALS, title="DoorCorridor-v0, random actions")
    table.add_column("what")
    for heading in ("floor, us", "step, us", "step / floor", "per second"):
        table.add_column(heading, justify="right")
    for row in rows:
        floor, ratio = row.get("floor_us"), row.get("ratio")
        table.add_row(
            row["what"],
            "" if floor is None else f"{floor:.1f}",
            f"{row['step_us']:.1f}",
            "" if ratio is None else f"{ratio:.2f}",
            f"{row['steps_per_s']:,.0f}",
        )
    return table


Case = Callable[[int], Result]
Made = tuple[Any, list[World]]


def _cases(num_envs: int) -> Iterator[Case]:
    yield lambda rounds: _single("one environment, gym.make", rounds)
    for threads in THREADS:
        yield lambda rounds, n=threads: _vector(num_envs, n, rounds)
    for beams in BEAMS:
        yield lambda rounds, n=beams: _single(f"{n} beams", rounds, laser=Laser(beams=n))
    for doors in DOORS:
        yield lambda rounds, n=doors: _doors(n, rounds)
    for extra in EXTRA_WALLS:
        yield lambda rounds, n=extra: _single(f"{n} more walls", rounds, world=_walled(n))
    yield _crop
    for name in RESETS:
        yield lambda rounds, world=name: _reset(world, rounds)


def _doors(doors: int, rounds: int) -> Result:
    steps = round(STEPS_PER_ROUND * min(1.0, DOORS[1] / max(doors, 1)))
    return _single(f"{doors} doors", rounds, steps, world=_corridor(doors))


def _single(name: str, rounds: int, steps: int = STEPS_PER_ROUND, **parameters: Any) -> Result:
    def make() -> Made:
        env = gym.make("DoorCorridor-v0", max_episode_steps=10**9, **parameters)
        env.reset(seed=0)
        assert isinstance(env.unwrapped, DoorWorldEnv)
        return env, [env.unwrapped.physics]

    return {"what": name} | _against_floor((make(), make()), (), steps, rounds)


def _crop(rounds: int) -> Result:
    """A step of `SlamWrapper` that observes the map around the robot; its floor: without."""
    twins = [_mapping(None), _mapping(CROP)]
    rng, pairs = np.random.default_rng(0), []
    for _ in range(rounds + 1):
        actions = rng.uniform(-1, 1, (SLAM_STEPS_PER_ROUND, 2)).astype(np.float32)
        spent = [_timed(lambda env=env, a=actions: _drive(env, a)) for env in twins]
        pairs.append([seconds / SLAM_STEPS_PER_ROUND for seconds in spent])
    without, fastest = (min(column) for column in zip(*pairs[1:], strict=True))
    return {
        "what": f"SlamWrapper, map_crop={CROP:g} (floor: none)",
        "floor_us": without * 1e6,
        "step_us": fastest * 1e6,
        "ratio": median(step / floor for floor, step in pairs[1:]),
        "steps_per_s": 1 / fastest,
    }


def _mapping(map_crop: float | None) -> SlamWrapper:
    env = gym.make("DoorCorridor-v0", max_episode_steps=10**9)
    wrapped = SlamWrapper(env, score_every=0, map_crop=map_crop)
    wrapped.reset(seed=0)
    return wrapped


def _vector(num_envs: int, threads: int, rounds: int) -> Result:
    def make(threads: int) -> Made:
        env = gym.make_vec("DoorCorridor-v0", num_envs, max_episode_steps=10**9, threads=threads)
        env.reset(seed=0)
        assert isinstance(env, DoorWorldVectorEnv)
        return env, env.physics

    name = f"one of {num_envs}, gym.make_vec" + (f", {threads} threads" if threads > 1 else "")
    steps = max(VECTOR_STEPS_PER_ROUND // num_envs, 1)
    pair = make(threads), make(1)
    return {"what": name} | _against_floor(pair, (num_envs,), steps, rounds)


def _against_floor(
    pair: tuple[Made, Made], shape: tuple[int, ...], steps: int, rounds: int
) -> Result:
    """Time drives of `steps` steps, alternating with a twin of which only the physics counts."""
    (env, worlds), (twin, twin_worlds) = pair
    for world in worlds:
        world.mechanics.catch_up()  # makes its space, as it would once in the episode
    floors = []
    for world in twin_worlds:
        world.mechanics = timer = PhysicsTimer(world.mechanics)
        floors.append(timer.states)
    rng, pairs = np.random.default_rng(0), []
    for count in (WARM_UP_STEPS, *[steps] * rounds):
        actions = rng.uniform(-1, 1, (count, *shape, 2)).astype(np.float32)
        for floor in floors:
            floor.spent = 0.0
        spent = _timed(lambda a=actions: _drive(env, a))
        _drive(twin, actions)
        made = count * len(worlds)
        pairs.append((sum(floor.spent for floor in floors) / made, spent / made))
    lowest, fastest = (min(column) for column in zip(*pairs[1:], strict=True))
    return {
        "floor_us": lowest * 1e6,
        "step_us": fastest * 1e6,
        "ratio": median(step / floor for floor, step in pairs[1:]),
        "steps_per_s": 1 / fastest,
    }


class PhysicsTimer(Mechanics):
    """Mechanics of a world that never leaves its space of pymunk."""

    def __init__(self, mechanics: Mechanics):
        self.bodies, self.contacts = mechanics.bodies, mechanics.contacts
        self._timed = mechanics.in_space()
        self.states = TimedStates(self._timed.space, self.bodies.rows)
        self._timed.states = self.states

    def advance(self, steps: int) -> None:
        """See `Mechanics.advance`."""
        self._timed.advance(steps, PHYSICS_DT)


class TimedStates(BodyStates):
    """States advanced by pymunk's own `Space.step`, whose time is added up."""

    spent = 0.0

    def advance_sorted(self, steps: int, dt: float, bodies: Bodies, leaves: int) -> None:
        """See `BodyStates.advance_sorted`."""
        step = self.space.step
        start = time.process_time()
        for _ in range(steps):
            step(dt)
        self.spent += time.process_time() - start
        self.advance(0, dt)


def _drive(env: Any, actions: np.ndarray) -> None:
    for action in actions:
        env.step(action)


def _reset(name: str, rounds: int) -> Result:
    env = gym.make(name)
    env.reset(seed=0)

    def resets() -> None:
        for _ in range(RESETS_PER_ROUND):
            env.reset()

    fastest = min(_timed(resets) / RESETS_PER_ROUND for _ in range(rounds))
    return {"what": f"reset of {name}", "step_us": fastest * 1e6, "steps_per_s": 1 / fastest}


def _timed(call: Callable[[], None]) -> float:
    start = time.process_time()
    call()
    return time.process_time() - start


def _corridor(doors: int) -> Corridor:
    """A corridor with a number of doors, at least as long as the default one."""
    return Corridor(doors_per_side=doors // 2, length=max(12.0, 1.5 * doors))


def _walled(extra: int) -> Layout:
    """The default corridor with `extra` short walls behind its rooms."""
    rng = np.random.default_rng(0)
    layout = Corridor().layout(rng)
    start = rng.uniform((0.0, 5.0), (12.0, 12.0), (extra, 2))
    turned = rng.uniform(0.0, 2 * np.pi, extra)
    stop = start + 0.5 * np.column_stack([np.cos(turned), np.sin(turned)])
    return replace(layout, walls=np.vstack([layout.walls, np.hstack([start, stop])]))
