"""`python -m docs.making.goal_scores [EPISODES]`: reference scores of `DoorPatrolGoals-v0`.

Rules that choose a goal by the observation alone, on the first test episodes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from slam.benchmark.statistics import Interval, median

EPISODES = 30
LOOK_AROUND, FRONTIERS, DOORS = 0, slice(1, 5), slice(5, 9)  # actions
LENGTH, UNSEEN = 1, 5  # columns of the observation's `goals`
HEAD = """\
| rule | return | Brier of doors | steps with contact, % | decisions |
|---|---|---|---|---|"""

Rule = Callable[[Any, np.random.Generator], int]


class Score(NamedTuple):
    """Of an episode: sum of rewards; means over time of the doors' Brier score and of contact, %;
    number of decisions."""

    total: float
    brier: float
    touched: float
    decisions: float


def by_chance(observation: Any, rng: np.random.Generator) -> int:
    """Any goal that is offered, with equal probability."""
    return int(rng.choice(np.flatnonzero(observation["action_mask"])))


def look_around(observation: Any, rng: np.random.Generator) -> int:
    """Turn on the spot."""
    return LOOK_AROUND


def nearest(observation: Any, rng: np.random.Generator) -> int:
    """The goal with the shortest path; look around where there is none."""
    offered = observation["action_mask"].astype(bool)
    offered[LOOK_AROUND] = False
    lengths = np.where(offered, observation["goals"][:, LENGTH], np.inf)
    return int(lengths.argmin()) if offered.any() else LOOK_AROUND


def nearest_frontier(observation: Any, rng: np.random.Generator) -> int:
    """The nearest frontier; where there is none, the door unseen longest."""
    return _first(observation, FRONTIERS) or _first(observation, DOORS)


def longest_unseen(observation: Any, rng: np.random.Generator) -> int:
    """The door unseen longest; where there is none, the nearest frontier."""
    return _first(observation, DOORS) or _first(observation, FRONTIERS)


def _first(observation: Any, slots: slice) -> int:
    """The first action among `slots` that has a goal; else look around."""
    offered = np.flatnonzero(observation["action_mask"][slots])
    return slots.start + int(offered[0]) if len(offered) else LOOK_AROUND


RULES: dict[str, Rule] = {
    "random goal": by_chance,
    "look around": look_around,
    "nearest goal": nearest,
    "nearest frontier": nearest_frontier,
    "door unseen longest": longest_unseen,
}


def episode(rule: Rule, index: int) -> Score:
    """Patrol test episode `index` to its end."""
    env = gym.make("dynslam_env:DoorPatrolGoals-v0")
    observation, _ = env.reset(options={"split": "test", "index": index})
    rng, over = np.random.default_rng(index), False
    rewards, briers, touched, steps = [], [], [], []
    while not over:
        observation, reward, terminated, truncated, info = env.step(rule(observation, rng))
        rewards.append(float(reward))
        briers.append(info["door_brier"])
        touched.append(100.0 * info["collision"])
        steps.append(info["steps"])
        over = terminated or truncated
    brier, contact = (float(np.average(values, weights=steps)) for values in (briers, touched))
    return Score(sum(rewards), brier, contact, len(rewards))


def rows(episodes: int) -> Iterator[str]:
    """The table's rows, in Markdown: medians with bootstrap 95 % intervals."""
    for name, rule in RULES.items():
        columns = zip(*(episode(rule, index) for index in range(episodes)), strict=True)
        texts = (
            _text(median(values), form)
            for values, form in zip(columns, (".1f", ".3f", ".1f", ".0f"), strict=True)
        )
        yield f"| {name} | {' | '.join(texts)} |"


def _text(interval: Interval, form: str) -> str:
    value, low, high = (format(number, form) for number in interval)
    return f"{value} ({low} to {high})"


if __name__ == "__main__":
    print(HEAD, flush=True)
    for row in rows(int(sys.argv[1]) if len(sys.argv) > 1 else EPISODES):
        print(row, flush=True)
