"""PPO or recurrent PPO on a native vector environment, in a folder from which it can resume."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from agents.training.event_log import event_logger
from agents.training.policy_file import restore
from agents.training.segments import BEST, CHECKPOINT, PROGRESS, Segments
from agents.training.settings import arguments
from agents.training.torch_setup import configure_torch, use_channels_last
from agents.training.training_folder import CONFIG, find_checkpoint, write_config
from agents.training.workers import Workers
from agents.vec_env import NativeVecEnv
from dynslam_env.simulation.find_world import find_world
from slam.errors import InputError
from slam.validation import one_of, whole_number

ALGORITHMS: dict[str, type[OnPolicyAlgorithm]] = {"ppo": PPO, "recurrent-ppo": RecurrentPPO}
SEGMENT_ROLLOUTS = 40  # rollouts between two evaluations and checkpoints
Report = Callable[[dict[str, Any]], None]


@dataclass(frozen=True)
class Training:
    """The configuration of a training: the same configuration gives the same policy.

    env         id of an environment with a native vector environment
    parameters  keywords of the environment, as plain data; `world` as `find_world` takes it
    algorithm   of ALGORITHMS
    settings    hyperparameters; see `settings.read_settings`
    seed        of all random numbers
    steps       of all environments together, rounded up to whole rollouts
    segment     rollouts between two checkpoints
    """

    env: str
    algorithm: str
    settings: dict[str, Any]
    seed: int = 0
    steps: int = 1_000_000
    parameters: dict[str, Any] = field(default_factory=dict)
    segment: int = SEGMENT_ROLLOUTS

    def __post_init__(self) -> None:
        one_of("algo", self.algorithm, tuple(ALGORITHMS))
        whole_number("seed", self.seed, 0)
        whole_number("steps", self.steps, 1)
        whole_number("segment", self.segment, 1)
        whole_number("n_envs", self.num_envs, 1)
        whole_number("n_steps", self.num_steps, 1)

    @property
    def num_envs(self) -> int:
        """Parallel environments."""
        return self.settings.get("n_envs", 32)

    @property
    def num_steps(self) -> int:
        """Steps of one rollout in each environment."""
        return self.settings.get("n_steps", 64)

    @property
    def rollout(self) -> int:
        """Steps of one rollout in all environments together."""
        return self.num_envs * self.num_steps


def train(
    training: Training, folder: Path, *, resume: bool = False, workers: int = 1,
    report: Report = lambda row: None, counted: Callable[[int], None] = lambda count: None,
) -> OnPolicyAlgorithm:  # fmt: skip
    """Train in `folder`, which gets `config.json`, `progress.jsonl` (a line per evaluation),
    `checkpoint.zip`, `best.zip` and TensorBoard's files.

    resume   continue the interrupted training of this configuration, or begin it
    workers  processes that share the environments; the policy does not depend on it
    report   is called with each line of `progress.jsonl`
    counted  is called with the number of steps so far, at each of them
    """
    configure_torch()
    before = random.getstate(), np.random.get_state(), torch.get_rng_state()  # noqa: NPY002
    kind, plain = ALGORITHMS[training.algorithm], json.loads(json.dumps(asdict(training)))
    env = VecMonitor(_environments(training, workers))
    try:
        checkpoint = find_checkpoint(plain, folder, resume)
        model = _new(kind, training, env, folder)
        known = 0
        if checkpoint is not None:
            restore(model, checkpoint)
            known = model.num_timesteps + 1
        use_channels_last(model)
        model.set_logger(event_logger(folder, known))
        write_config(plain, folder)  # after all checks of the input
        left = training.steps - model.num_timesteps
        steps = training.segment * training.rollout
        segments = Segments(folder, training.seed, steps, asdict(training), report, counted)
        if left > 0:
            model.learn(left, segments, reset_num_timesteps=checkpoint is None)
        return model
    finally:
        env.close()
        random.setstate(before[0])
        np.random.set_state(before[1])  # noqa: NPY002
        torch.set_rng_state(before[2])


def _environments(training: Training, workers: int) -> VecEnv:
    parameters = dict(training.parameters)
    if isinstance(parameters.get("world"), str):
        parameters["world"] = find_world(parameters["world"])
    if workers == 1:
        return NativeVecEnv.make(training.env, training.num_envs, **parameters)
    return Workers(training.env, training.num_envs, workers, parameters)


def _new(
    kind: type[OnPolicyAlgorithm], training: Training, env: VecEnv, folder: Path
) -> OnPolicyAlgorithm:
    """A new model; raises InputError for settings that it does not take."""
    given: dict[str, Any] = {**arguments(training.settings), "n_steps": training.num_steps}
    try:
        return kind(
            training.settings["policy"], env, seed=training.seed, device="cpu",
            **given,
        )  # fmt: skip
    except (AssertionError, KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{training.algorithm} does not take these hyperparameters ({error!r})"
        ) from None


__all__ = ["ALGORITHMS", "BEST", "CHECKPOINT", "CONFIG", "PROGRESS", "Training", "train"]
