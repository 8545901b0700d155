"""Trained: a policy that `dynslam train` learned. Needs `dynslam[train]`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from numpy.typing import NDArray

from agents.training.policy_file import read_policy
from agents.training.settings import arguments
from agents.training.train import KINDS
from slam.errors import InputError


class Trained:
    """Acts as the policy in a file says. Weights are read, and nothing in the file is run.

    path  of best.zip, checkpoint.zip, or of what `policy_file.slim` made of one
    env   whose observations and actions are to be those that it was trained with
    """

    def __init__(self, path: Path, env: gym.Env[Any, Any]):
        told, weights = read_policy(path)
        try:
            kind, given = KINDS[told["algorithm"]], arguments(told["settings"])
            policy = kind.policy_aliases[told["settings"]["policy"]]
        except (KeyError, TypeError) as error:
            raise InputError(f"{path}: not a policy that dynslam train wrote ({error!r})") from None
        self._policy = policy(
            env.observation_space, env.action_space, lambda _: 0.0, **given.get("policy_kwargs", {})
        )  # fmt: skip
        try:
            self._policy.load_state_dict(weights)
        except (RuntimeError, TypeError):
            raise InputError(
                f"{path}: learned in {told['env']}, whose observations or actions are others"
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
        """The action (2,), in -1 .. 1, and the policy's own state, if it has one."""
        return self._policy.predict(observation, state, episode_start, deterministic)
