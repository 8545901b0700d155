"""`python -m docs.making.laser_steps`: processor time of a step of `DoorOffice-v0` by laser."""

from __future__ import annotations

import time
from typing import Any

import gymnasium as gym
import numpy as np

from dynslam_env import LASERS

STEPS, ROUNDS = 200, 9  # the fastest round counts


def microseconds(**parameters: Any) -> float:
    """us of a step, with random actions (seed 0)."""
    env = gym.make("dynslam_env:DoorOffice-v0", max_episode_steps=-1, **parameters)
    env.reset(seed=0)
    rng, rounds = np.random.default_rng(0), []
    for _ in range(ROUNDS):
        actions = rng.uniform(-1, 1, (STEPS, 2)).astype(np.float32)
        begun = time.process_time()
        for action in actions:
            env.step(action)
        rounds.append((time.process_time() - begun) / STEPS)
    return min(rounds) * 1e6


if __name__ == "__main__":
    print(f"no effects: {microseconds():.0f} us")
    for name in LASERS:
        print(f"{name}: {microseconds(laser=name):.0f} us")
