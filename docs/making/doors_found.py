"""`python -m docs.making.doors_found [FIRST [FLOORS]]`: how soon doors are known, and what is taken
for one.

`greedy` patrols offices and larger floors of the split train, with SLAM in the loop. Prints, over
the time and the floors: the share of the true doors in sight at some time, known, and known with a
leaf; the doorways that are none of them, and those of them with a leaf; and for how long a door was
in sight until it was known, of those that were.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

import agents
from dynslam_env.patrol.door_looks import looked
from dynslam_env.patrol.long_env import LongPatrolEnv
from dynslam_env.patrol.place_doors import MIN_BEAMS
from slam.geometry import Array

FIRST, FLOORS = 340, 10
BUDGET = 600.0  # s
SAME = 0.6  # m, from a believed doorway to a true door
COUNTS = "doors in sight", "doors known", "with a leaf", "others known", "others with a leaf"


def main(first: int = FIRST, floors: int = FLOORS) -> None:
    """Drive, and print."""
    for difficulty in (None, "hard"):
        rows = [patrol(difficulty, index) for index in range(first, first + floors)]
        counts = np.mean([row[0] for row in rows], axis=0)
        sights = np.array([time for row in rows for time in row[1]])
        print("larger floors" if difficulty else "office")
        for name, count in zip(COUNTS, counts, strict=True):
            print(f"  {name}: {count:.3f}")
        print(
            f"  s in sight until known: median {np.median(sights):.1f}, mean {np.mean(sights):.1f}"
        )


def patrol(difficulty: str | None, index: int) -> tuple[Array, list[float]]:
    """(5,) COUNTS of an episode, and s in sight of each door that was known."""
    env = LongPatrolEnv(difficulty=difficulty)
    observation, info = env.reset(options={"split": "train", "index": index})
    agent = agents.make("greedy", env, index)
    doors = [[*door.middle, door.closed, door.width] for door in env.place.layout.doors]
    truth, counts = np.array(doors).reshape(-1, 4), []
    seen, known = np.zeros(len(truth)), np.full(len(truth), np.nan)
    while info["time"] < BUDGET:
        observation, *_, info = env.step(agent.predict(observation)[0])
        shown = looked(env.wrapped.scan, env.slam.pose, truth)
        seen += env.period * ((shown[:, 0] >= MIN_BEAMS) | (shown[:, 3] > 0))
        row, is_known = _counted(env, truth)
        counts.append([(seen > 0).mean(), *row])
        known = np.where(is_known & np.isnan(known), seen, known)
    return np.mean(counts, axis=0), known[~np.isnan(known)].tolist()


def _counted(env: Any, truth: Array) -> tuple[list[float], Array]:
    """The last four of COUNTS now, and which doors (d,) are known."""
    found = np.zeros((2, len(truth)), np.bool_)
    others = [0.0, 0.0]
    for one in env.door_beliefs():
        away = np.hypot(*(truth[:, :2] - one.place[:2]).T)
        if not np.isfinite(one.age):
            continue
        if away.min(initial=np.inf) < SAME:
            found[:, away.argmin()] |= [True, one.leaf]
        else:
            others = [others[0] + 1.0, others[1] + one.leaf]
    return [*found.mean(axis=1).tolist(), *others], found[0]


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
