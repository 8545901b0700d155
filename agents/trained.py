"""Trained: a policy of `dynslam train` as an agent. Needs `dynslam[train]`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from numpy.typing import NDArray

from agents.training.policy_file import read_policy
from agents.training.settings import arguments
from agents.training.train import ALGORITHMS
from slam.errors import InputError


class Trained:
    """Acts by the policy in a file; only its weights are read, no code in it is run.

    path  of best.zip, checkpoint.zip, or a copy by `policy_file.write_slim`
    env   environment with the observation and action spaces of the training
    """

    def __init__(self, path: Path, env: gym.Env[Any, Any]):
        training, weights = read_policy(path)
        try:
            kind, given = ALGORITHMS[training["algorithm"]], arguments(training["settings"])
            policy = kind.policy_aliases[training["settings"]["policy"]]
        except (KeyError, TypeError) as error:
            raise InputError(f"{path}: not a policy of dynslam train ({error!r})") from None
        self._policy = policy(
            env.observation_space, env.action_space, lambda _: 0.0, **given.get("policy_kwargs", {})
        )  # fmt: skip
        try:
            self._policy.load_state_dict(weights)
        except (RuntimeError, TypeError):
            raise InputError(
                f"{path}: trained in {training['env']}, which has other observations or actions"
            ) from None
        self._policy.set_training_mode(False)
        torch.set_num_threads(1)

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """The action (2,), in -1 .. 1, and the policy's recurrent state, if any."""
        return self._policy.predict(observation, state, episode_start, deterministic)
