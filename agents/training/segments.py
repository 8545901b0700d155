"""Segments of a training: after each an evaluation and a checkpoint from which it can resume."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from agents.training.policy_file import save_model
from slam.benchmark.results import append, read
from slam.errors import InputError

EVALUATION_SEED = 900_000  # the first seed of the evaluations during training
CHECKPOINT = "checkpoint.zip"
BEST = "best.zip"
PROGRESS = "progress.jsonl"
NUMBERS = ("steps", "reward", "seconds")  # of every line of it


class Segments(BaseCallback):
    """Divides a training into segments of `steps` steps. Between two it evaluates and saves the
    policy, then seeds all random generators, the environments' too, by the training's seed and the
    segment's number alone. A resumed training therefore equals an uninterrupted one.

    folder    of the checkpoint, the best policy and the evaluations
    seed      of the training
    steps     of a segment; a multiple of the steps of a rollout
    training  its configuration, to be kept in the policies' files
    report    is called with each evaluation
    counted   is called with the number of steps so far, at each of them
    """

    def __init__(
        self,
        folder: Path,
        seed: int,
        steps: int,
        training: Mapping[str, Any],
        report: Callable[[dict[str, Any]], None],
        counted: Callable[[int], None],
    ):
        super().__init__()
        self._folder, self._seed, self._steps = folder, seed, steps
        self._training, self._report, self._counted = training, report, counted
        before = read_progress(folder)
        self._began = time.perf_counter() - (before[-1]["seconds"] if before else 0.0)

    @property
    def algorithm(self) -> OnPolicyAlgorithm:
        """The model in training."""
        assert isinstance(self.model, OnPolicyAlgorithm)
        return self.model

    def _on_step(self) -> bool:
        self._counted(self.num_timesteps)
        return True

    def _on_rollout_start(self) -> None:
        if self.model.num_timesteps % self._steps == 0:
            self._evaluate()
            self._begin(self.model.num_timesteps // self._steps)

    def _on_training_end(self) -> None:
        self._evaluate()

    def _begin(self, segment: int) -> None:
        """Seed all random generators, and reset the environments."""
        model = self.algorithm
        draws = np.random.SeedSequence((self._seed, segment)).generate_state(3) >> 1
        torch.manual_seed(int(draws[0]))
        np.random.seed(int(draws[1]))  # noqa: NPY002 - stable-baselines3 draws from it
        env = model.get_env()
        assert env is not None
        env.seed(int(draws[2]))
        model._last_obs = env.reset()  # type: ignore[assignment]
        model._last_episode_starts = np.ones(env.num_envs, dtype=bool)

    def _evaluate(self) -> None:
        """Evaluate and save the policy, once for each number of steps."""
        done = read_progress(self._folder)
        model = self.algorithm
        if done and done[-1]["steps"] >= model.num_timesteps:
            return
        line = {"steps": model.num_timesteps, **evaluation(model)}
        line["seconds"] = time.perf_counter() - self._began
        for name, value in line.items():
            self.logger.record(f"evaluation/{name}", value)
        best = max((row["reward"] for row in done), default=-np.inf)
        if line["reward"] > best:
            save_model(model, self._training, self._folder / BEST)
        save_model(model, self._training, self._folder / CHECKPOINT)
        append(self._folder / PROGRESS, line)
        self.logger.dump(model.num_timesteps)
        self._report(line)


def read_progress(folder: Path) -> list[dict[str, Any]]:
    """The evaluations so far; a line that was cut off is left out. Raises InputError for others."""
    path = folder / PROGRESS
    rows = read(path) if path.exists() else []
    if any(not isinstance(row.get(name), int | float) for row in rows for name in NUMBERS):
        raise InputError(f"{path}: expected {', '.join(NUMBERS)} in every line")
    return rows


def evaluation(model: OnPolicyAlgorithm) -> dict[str, float]:
    """Mean sum of rewards, of each reward term, and mean Brier score of the doors over time, over
    one deterministic episode in each environment; the seeds are held out from training."""
    env = model.get_env()
    assert env is not None
    env.seed(EVALUATION_SEED)
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
            steps = infos[k].get("steps", 1)  # of a goal; other decisions are all of one length
            briers[k] += steps * infos[k]["door_brier"]
            moments[k] += steps
        running &= ~start
    return {**sums, "door_brier": float((briers / moments).mean())}
