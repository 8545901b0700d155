"""`python -m docs.making.fast_setting`: the fast setting beside SLAM in the loop.

`greedy` drives both, on the same floors of the split train and with the same law of doors. Prints
the Brier score of the doors, the doorways that are known, and those of them with a known leaf.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import agents
from agents.viewpoints.features import GREEDY
from agents.viewpoints.floors import draw_floors
from agents.viewpoints.patrols import BUDGET, Patrols
from agents.viewpoints.ppo import by_feature
from dynslam_env.patrol.long_env import LongPatrolEnv
from dynslam_env.worlds.office import Office

FIRST, FLOORS = 100, 12
DRAWN = 20  # patrols of the fast setting on each floor
PARTS = np.array([0.0, 60.0, 150.0, BUDGET])  # s
TIMES = np.array([30.0, 60.0, 100.0, 150.0, 300.0])  # s


def main() -> None:
    """Drive, and print both."""
    told = {"fast setting": fast(), "SLAM in the loop": with_slam()}
    for name, (errors, known, leaves) in told.items():
        print(name)
        for k, error in enumerate(errors):
            print(f"  {PARTS[k]:.0f} to {PARTS[k + 1]:.0f} s: Brier score {error:.3f}")
        for time, count, seen in zip(TIMES, known, leaves, strict=True):
            print(f"  {time:.0f} s: {count:.1f} doorways, {seen:.2f} leaves")


def fast() -> tuple[Any, Any, Any]:
    """Means of the fast setting: (3,) Brier scores, (5,) known doorways, (5,) known leaves."""
    floors = draw_floors(Office(), "train", FIRST, FLOORS)
    n = DRAWN * len(floors.doors)
    patrols, choose = Patrols(floors, n, np.random.default_rng(0)), by_feature(GREEDY)
    for i in range(n):
        patrols.restart(i, i % len(floors.doors))
    patrols.look()
    state, error, spent = patrols.state, np.zeros(3), np.zeros(3)
    known, leaves = np.full((n, len(TIMES)), np.nan), np.full((n, len(TIMES)), np.nan)
    while state.time.min() < BUDGET:
        before = state.time.copy()
        lost, takes, _ = patrols.step(choose(patrols))
        patrols.look()
        part = np.searchsorted(PARTS, before, side="right") - 1
        np.add.at(error, part[part < 3], lost[part < 3])
        np.add.at(spent, part[part < 3], np.minimum(takes, BUDGET - before)[part < 3])
        seen = np.isfinite(state.age)
        for i, t in np.argwhere((before[:, None] < TIMES) & (state.time[:, None] >= TIMES)):
            known[i, t] = seen[i].sum()
            leaves[i, t] = (seen[i] & (state.hidden[i] == 0.0)).sum()
    return error / spent, np.nanmean(known, axis=0), np.nanmean(leaves, axis=0)


def with_slam() -> tuple[Any, Any, Any]:
    """The same of episodes with SLAM in the loop."""
    errors, known, leaves = [], [], []
    for index in range(FIRST, FIRST + FLOORS):
        env = LongPatrolEnv()
        observation, info = env.reset(options={"split": "train", "index": index})
        agent, rows, times, left = agents.make("greedy", env, index), [], [], list(TIMES)
        counts, seen = [], []
        while info["time"] < BUDGET:
            observation, *_, info = env.step(agent.predict(observation)[0])
            rows.append(info["door_brier"])
            times.append(info["time"])
            if left and info["time"] >= left[0]:
                left.pop(0)
                beliefs = env.door_beliefs()
                counts.append(sum(np.isfinite(one.age) for one in beliefs))
                seen.append(sum(one.leaf for one in beliefs))
        parts = np.minimum(np.searchsorted(PARTS, times, side="left") - 1, 2)
        errors.append([np.mean(np.array(rows)[parts == k]) for k in range(3)])
        known.append(counts)
        leaves.append(seen)
    return tuple(np.mean(rows, axis=0) for rows in (errors, known, leaves))


if __name__ == "__main__":
    main()
