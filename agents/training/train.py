"""train: PPO or recurrent PPO on a native vector environment, in a folder to go on in."""

from __future__ import annotations

import json
import random
import zipfile
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

from agents.training.cores import lay_out, use_cores
from agents.training.folder import CONFIG, checkpoint_of, make_ready
from agents.training.legs import BEST, CHECKPOINT, PROGRESS, Legs
from agents.training.settings import arguments
from agents.training.workers import Workers
from agents.vec_env import NativeVecEnv
from slam.errors import InputError
from slam.validation import one_of, whole_number

KINDS: dict[str, type[OnPolicyAlgorithm]] = {"ppo": PPO, "recurrent-ppo": RecurrentPPO}
LEG_ROLLOUTS = 40  # after so many rollouts a checkpoint, and an evaluation
Tell = Callable[[dict[str, Any]], None]


@dataclass(frozen=True)
class Training:
    """What is learned: the same training gives the same policy.

    env         id of an environment with a native vector environment
    parameters  of the environment, as plain data
    algorithm   of KINDS
    settings    hyperparameters; see `settings.read_settings`
    seed        of all that is random
    steps       of all worlds together, rounded up to whole rollouts
    leg         rollouts between two checkpoints
    """

    env: str
    algorithm: str
    settings: dict[str, Any]
    seed: int = 0
    steps: int = 1_000_000
    parameters: dict[str, Any] = field(default_factory=dict)
    leg: int = LEG_ROLLOUTS

    def __post_init__(self) -> None:
        one_of("algo", self.algorithm, tuple(KINDS))
        whole_number("seed", self.seed, 0)
        whole_number("steps", self.steps, 1)
        whole_number("leg", self.leg, 1)
        whole_number("n_envs", self.num_envs, 1)
        whole_number("n_steps", self.num_steps, 1)

    @property
    def num_envs(self) -> int:
        """Worlds side by side."""
        return self.settings.get("n_envs", 32)

    @property
    def num_steps(self) -> int:
        """Steps of one rollout, of each world."""
        return self.settings.get("n_steps", 64)

    @property
    def rollout(self) -> int:
        """Steps of one rollout, of all worlds together."""
        return self.num_envs * self.num_steps


def train(
    what: Training, folder: Path, *, resume: bool = False, workers: int = 1,
    tell: Tell = lambda row: None,
) -> OnPolicyAlgorithm:  # fmt: skip
    """Train in `folder`, which gets `config.json`, `progress.jsonl` (a line for each evaluation),
    `checkpoint.zip`, `best.zip` and TensorBoard's files.

    resume   go on where a training of the same kind was broken off; without one there, begin
    workers  processes that share the worlds; the policy does not depend on it
    tell     is told each line of `progress.jsonl`
    """
    use_cores()
    before = random.getstate(), np.random.get_state(), torch.get_rng_state()  # noqa: NPY002
    kind, plain = KINDS[what.algorithm], json.loads(json.dumps(asdict(what)))
    env = VecMonitor(_worlds(what, workers))
    try:
        checkpoint = checkpoint_of(plain, folder, resume)
        if checkpoint is not None:
            model = _loaded(kind, checkpoint, env)
        else:
            model = _made(kind, what, env, folder)
        lay_out(model)
        make_ready(plain, folder)  # after all mistakes that are told
        left = what.steps - model.num_timesteps
        legs = Legs(folder, what.seed, what.leg * what.rollout, asdict(what), tell)
        if left > 0:
            model.learn(
                left, legs, reset_num_timesteps=checkpoint is None, tb_log_name="tensorboard"
            )
        return model
    finally:
        env.close()
        random.setstate(before[0])
        np.random.set_state(before[1])  # noqa: NPY002
        torch.set_rng_state(before[2])


def _worlds(what: Training, workers: int) -> VecEnv:
    if workers == 1:
        return NativeVecEnv.make(what.env, what.num_envs, **what.parameters)
    return Workers(what.env, what.num_envs, workers, what.parameters)


def _made(
    kind: type[OnPolicyAlgorithm], what: Training, env: VecEnv, folder: Path
) -> OnPolicyAlgorithm:
    """A new one; libraries complain of settings in many ways."""
    given: dict[str, Any] = {**arguments(what.settings), "n_steps": what.num_steps}
    try:
        return kind(
            what.settings["policy"], env, seed=what.seed, device="cpu",
            tensorboard_log=str(folder), **given,
        )  # fmt: skip
    except (AssertionError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"no {what.algorithm} can be made of its settings ({error!r})") from None


def _loaded(kind: type[OnPolicyAlgorithm], path: Path, env: VecEnv) -> OnPolicyAlgorithm:
    """The one in a checkpoint."""
    try:
        return kind.load(path, env, device="cpu")
    except (EOFError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: no checkpoint to go on from ({error})") from None


__all__ = ["BEST", "CHECKPOINT", "CONFIG", "KINDS", "PROGRESS", "Training", "train"]
