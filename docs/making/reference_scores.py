"""`python -m docs.making.reference_scores [EPISODES [ID ...]]`: reference scores of docs/splits.md.

Drives the first test episodes of each world by chance, along walls by the laser and the odometry,
and along its path by the true pose.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import gymnasium as gym
import joblib
import numpy as np

from agents import RandomAgent, ScriptedPath
from agents.wall_follower import WallFollower
from dynslam_env import WORLDS, DoorWorldEnv
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from dynslam_env.record import Driver
from dynslam_env.reset_options import DIFFICULTIES
from dynslam_env.simulation.world import CONTROL_DT
from slam.benchmark.statistics import Interval, median, share
from slam.geometry import Pose2

EPISODES = 30
LEVELS = (None, *DIFFICULTIES)  # None: the world as it is registered
HEAD = """\
| environment | difficulty | agent | arrived | return | steps with contact |
|---|---|---|---|---|---|"""


class Score(NamedTuple):
    """Of an episode: sum of rewards, whether the path was completed, share of steps with contact"""

    total: float
    arrived: bool
    touched: float


def scripted(env: DoorWorldEnv, index: int) -> Driver:
    """Drives along the layout's path by the true pose."""
    return ScriptedPath(env.layout.path, lambda: env.pose, env.robot)


def by_chance(env: DoorWorldEnv, index: int) -> Driver:
    """Uniformly random actions."""
    return RandomAgent(env.action_space, seed=index)


def along_walls(env: DoorWorldEnv, index: int) -> Driver:
    """Follows walls by the scans; knows whether it is stuck by the odometry."""
    return WallFollower(DeadReckoning(env), seed=index)


class DeadReckoning:
    """A world as an agent without maps sees it: `PatrolView`, once in each step."""

    def __init__(self, env: DoorWorldEnv):
        self._env, self._pose = env, Pose2()
        self._limits = env.robot.max_speed, env.robot.max_turn

    def snapshot(self) -> PatrolSnapshot:
        """What the robot knows now: the scan, and where the odometry says that it is."""
        env = self._env
        self._pose = self._pose @ env.displacement
        scan = env.scan
        return PatrolSnapshot(
            scan.time, self._pose, np.zeros((3, 3)), scan, env.robot, self._limits, CONTROL_DT,
            _no_map, _no_map,
        )  # fmt: skip


def _no_map() -> Any:
    raise RuntimeError("there is no map without a SLAM")


AGENTS: dict[str, Callable[[DoorWorldEnv, int], Driver]] = {
    "random": by_chance,
    "wall follower": along_walls,
    "scripted path": scripted,
}


def episode(name: str, difficulty: str | None, agent: str, index: int) -> Score:
    """Drive test episode `index` to its end."""
    env: Any = gym.make(f"dynslam_env:{name}", difficulty=difficulty)
    observation, info = env.reset(options={"split": "test", "index": index})
    driver = AGENTS[agent](env.unwrapped, index)
    total, touched, steps, over = 0.0, 0, 0, False
    while not over:
        action, _ = driver.predict(observation)
        observation, reward, terminated, truncated, info = env.step(action)
        total, touched, steps = total + reward, touched + info["collision"], steps + 1
        over = terminated or truncated
    return Score(total, info["ends"]["arrived"], touched / steps)


def rows(episodes: int, names: Sequence[str]) -> Iterator[str]:
    """The table's rows, in Markdown."""
    for name, level, agent in product(names, LEVELS, AGENTS):
        one = partial(episode, name, level, agent)
        done: Any = joblib.Parallel(n_jobs=-1)(joblib.delayed(one)(i) for i in range(episodes))
        yield f"| `{name}` | {level or 'its own'} | {agent} | {_cells(done)} |"


def _cells(scores: list[Score]) -> str:
    totals, arrived, touched = zip(*scores, strict=True)
    there, contact = share(arrived), median(touched)
    return (
        f"{_text(there, 100.0, '.0f')} % | {_text(median(totals), 1.0, '.1f')} | "
        f"{_text(contact, 100.0, '.1f')} %"
    )


def _text(interval: Interval, scale: float, form: str) -> str:
    value, low, high = (format(scale * number, form) for number in interval)
    return f"{value} ({low} to {high})"


if __name__ == "__main__":
    print(HEAD)
    count, *chosen = sys.argv[1:] or [str(EPISODES)]
    for row in rows(int(count), chosen or list(WORLDS)):
        print(row, flush=True)
