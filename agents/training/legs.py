"""Legs: a training that is the same whether or not it was interrupted between two of them."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from agents.training.policy_file import save_model

EVALUATED = 900_000  # seeds from here on are those of the evaluations on the way
CHECKPOINT = "checkpoint.zip"
BEST = "best.zip"
PROGRESS = "progress.jsonl"


class Legs(BaseCallback):
    """Begins every `steps` steps anew: evaluates, saves, and then draws all randomness, that of the
    worlds too, from the seed and the number of the leg alone. Whoever goes on from a checkpoint
    therefore learns what would have been learned without the break.

    folder  where the checkpoint, the best policy and a line for each evaluation go
    seed    of the training
    steps   of a leg; a multiple of what a rollout takes
    told    what is trained, to be kept in the policies' files
    tell    is told each line
    """

    def __init__(
        self,
        folder: Path,
        seed: int,
        steps: int,
        told: Mapping[str, Any],
        tell: Callable[[dict[str, Any]], None],
    ):
        super().__init__()
        self._folder, self._seed, self._steps = folder, seed, steps
        self._told, self._tell = told, tell
        before = read_progress(folder)
        self._began = time.perf_counter() - (before[-1]["seconds"] if before else 0.0)

    @property
    def algorithm(self) -> OnPolicyAlgorithm:
        """What learns."""
        assert isinstance(self.model, OnPolicyAlgorithm)
        return self.model

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        if self.model.num_timesteps % self._steps == 0:
            self._report()
            self._begin(self.model.num_timesteps // self._steps)

    def _on_training_end(self) -> None:
        self._report()

    def _begin(self, leg: int) -> None:
        """All randomness anew."""
        model = self.algorithm
        draws = np.random.SeedSequence((self._seed, leg)).generate_state(3) >> 1
        torch.manual_seed(int(draws[0]))
        np.random.seed(int(draws[1]))  # noqa: NPY002 - stable-baselines3 draws from it
        env = model.get_env()
        assert env is not None
        env.seed(int(draws[2]))
        model._last_obs = env.reset()  # type: ignore[assignment]
        model._last_episode_starts = np.ones(env.num_envs, dtype=bool)

    def _report(self) -> None:
        """Evaluate, once for each state; keep the policy."""
        done = read_progress(self._folder)
        model = self.algorithm
        if done and done[-1]["steps"] >= model.num_timesteps:
            return
        line = {"steps": model.num_timesteps, **evaluated(model)}
        line["seconds"] = time.perf_counter() - self._began
        for name, value in line.items():
            self.logger.record(f"evaluation/{name}", value)
        best = max((row["reward"] for row in done), default=-np.inf)
        if line["reward"] > best:
            save_model(model, self._told, self._folder / BEST)
        save_model(model, self._told, self._folder / CHECKPOINT)
        with (self._folder / PROGRESS).open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        self._tell(line)


def read_progress(folder: Path) -> list[dict[str, Any]]:
    """The lines of evaluation so far; one that was cut off is left out."""
    path, rows = folder / PROGRESS, []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            break
    return rows


def evaluated(model: OnPolicyAlgorithm) -> dict[str, float]:
    """One deterministic episode in each world, of seeds that nothing is learned on: the mean of the
    sum of rewards, of each of its terms, and of the doors' Brier score over the time."""
    env = model.get_env()
    assert env is not None
    env.seed(EVALUATED)
    observation, state, start = env.reset(), None, np.ones(env.num_envs, dtype=bool)
    sums: dict[str, float] = {}
    running = np.ones(env.num_envs, dtype=bool)
    briers, moments = np.zeros(env.num_envs), np.zeros(env.num_envs)
    while running.any():
        actions, state = model.predict(observation, state, start, deterministic=True)  # type: ignore[arg-type]
        observation, rewards, start, infos = env.step(actions)
        for k in np.flatnonzero(running).tolist():
            for name, term in {"reward": float(rewards[k]), **infos[k]["reward_terms"]}.items():
                sums[name] = sums.get(name, 0.0) + term / env.num_envs
            briers[k] += infos[k]["door_brier"]
        moments += running
        running &= ~start
    return {**sums, "door_brier": float((briers / moments).mean())}
