"""Train a policy on a Gymnasium environment and evaluate it.

    python docs/examples/train_an_explorer.py --steps 800

Trains PPO of stable-baselines3 on DoorPatrol-v0 for some hundred steps: too few to learn anything,
but enough to show how the parts fit together. `dynslam train` does the full training
(docs/agents.md). Needs the extra [train].
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import gymnasium as gym
import numpy as np
import torch
import tyro
from stable_baselines3 import PPO

import agents
from agents.vec_env import NativeVecEnv

# --8<-- [start:evaluate]
SEEDS = range(8000, 8100)  # held-out worlds, on which nothing is learned


def evaluate(
    name: str, episodes: int, steps: int, policy: PPO | None = None
) -> tuple[float, float]:
    """Mean reward, and mean Brier score of the doors over time: 0.25 is a guess, less is better."""
    env = gym.make("DoorPatrol-v0", max_episode_steps=steps)
    rewards, briers = [], []
    for seed in SEEDS[:episodes]:
        observation, _ = env.reset(seed=seed)
        agent: Any = policy or agents.make(name, env)
        total, brier, over = 0.0, [], False
        while not over:
            action, _ = agent.predict(observation, deterministic=True)
            observation, reward, terminated, truncated, info = env.step(action)
            total, over = total + float(reward), terminated or truncated
            brier.append(info["door_brier"])
        rewards.append(total)
        briers.append(np.mean(brier))
    return float(np.mean(rewards)), float(np.mean(briers))


# --8<-- [end:evaluate]


# --8<-- [start:main]
@dataclass
class TrainAnExplorer:
    """Train PPO on DoorPatrol-v0 briefly, and compare it with the agents of dynslam."""

    steps: int = 800
    """Decisions to train on, of all worlds together."""
    worlds: int = 4
    """Worlds that are stepped together."""
    episodes: int = 3
    """Held-out episodes to evaluate on."""
    length: int = 250
    """Decisions of an episode (0.4 s each)."""
    out: Path = Path("out/explorer")
    """Directory that the policy is saved to."""

    def __call__(self) -> dict[str, tuple[float, float]]:
        """Train, save and evaluate; returns reward and Brier score of each agent."""
        torch.set_num_threads(1)  # two threads beside other work are slower than one
        worlds = NativeVecEnv.make("DoorPatrol-v0", self.worlds)
        policy = PPO("MultiInputPolicy", worlds, n_steps=50, batch_size=50, seed=0)
        policy.learn(self.steps)
        self.out.mkdir(parents=True, exist_ok=True)
        policy.save(self.out / "policy.zip")
        policy = cast(PPO, PPO.load(self.out / "policy.zip"))
        scores = {"this policy": evaluate("", self.episodes, self.length, policy)}
        for name in ("random", "nearest-frontier", "lookout", "ppo"):
            scores[name] = evaluate(name, self.episodes, self.length)
        for name, (reward, brier) in scores.items():
            print(f"{name:>16}: reward {reward:6.1f}, Brier of the doors {brier:.3f}")
        return scores


if __name__ == "__main__":
    tyro.cli(TrainAnExplorer)()
# --8<-- [end:main]
