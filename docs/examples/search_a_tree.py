"""Plan with copies of an environment: a small tree search among walking people.

    python docs/examples/search_a_tree.py --decisions 12

A copy of an environment goes on exactly as the original, with the same doors and people. The search
therefore knows the future: its reward is a bound for planners that do not.
"""

import copy
import time
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import tyro

import dynslam_env  # noqa: F401  (registers the environments)

# --8<-- [start:search]
HOLD = 10  # steps of 0.1 s for which a move is held
MOVES = {  # forward and turning velocity, -1 .. 1
    "ahead": (0.6, 0.0),
    "left": (0.4, 0.1),
    "right": (0.4, -0.1),
    "wait": (0.0, 0.0),
}


def hold(env: gym.Env[Any, Any], move: str) -> tuple[float, bool]:
    """Hold a move; the sum of its rewards, and whether the episode is over."""
    total, over = 0.0, False
    for _ in range(HOLD):
        if not over:
            _, reward, terminated, truncated, _ = env.step(np.array(MOVES[move], np.float32))
            total, over = total + float(reward), terminated or truncated
    return total, over


def search(env: gym.Env[Any, Any], depth: int) -> tuple[float, str]:
    """The largest reward of `depth` moves, and the first of them; `env` stays as it is."""
    best = (-np.inf, "")
    for move in MOVES:
        child = copy.deepcopy(env)
        reward, over = hold(child, move)
        if depth > 1 and not over:
            reward += search(child, depth - 1)[0]
        best = max(best, (reward, move))
    return best


# --8<-- [end:search]


# --8<-- [start:main]
@dataclass
class SearchATree:
    """Drive among people with and without a search, and compare the rewards."""

    seed: int = 0
    """Of the world."""
    decisions: int = 12
    """Moves of 1 s that are driven."""
    depth: int = 3
    """Moves that the search looks ahead."""

    def __call__(self) -> dict[str, float]:
        """Drive; returns the reward of each driver."""
        rewards = {}
        for depth in (0, self.depth):
            env, total, start = gym.make("DoorCrowd-v0"), 0.0, time.perf_counter()
            env.reset(seed=self.seed)
            for _ in range(self.decisions):
                total += hold(env, search(env, depth)[1] if depth else "ahead")[0]
            name = f"search of depth {depth}" if depth else "always ahead"
            rewards[name] = total
            print(f"{name}: reward {total:.2f}, {time.perf_counter() - start:.1f} s")
        return rewards


if __name__ == "__main__":
    tyro.cli(SearchATree)()
# --8<-- [end:main]
