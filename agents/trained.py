"""Trained: a policy of `dynslam train` as an agent. Needs `dynslam[train]`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from numpy.typing import NDArray

from agents.training.policy_file import read_policy
from agents.training.settings import arguments, check_network
from agents.training.train import ALGORITHMS
from slam.errors import InputError
from slam.io.guard import guarded
from slam.io.one_line import one_line


class Trained:
    """Acts by the policy in a file; only its weights are read, no code in it is run.

    path  of best.zip, checkpoint.zip, or a copy by `policy_file.write_slim`
    env   environment with the observation and action spaces of the training
    """

    def __init__(self, path: Path, env: gym.Env[Any, Any]):
        training, weights = read_policy(path)
        with guarded(path):
            self._policy = _policy(training, env)
        try:
            self._policy.load_state_dict(weights)
        except (AttributeError, RuntimeError, TypeError):
            raise InputError(
                f"{path}: trained in {one_line(training.get('env'), 60)}, which has other "
                f"observations or actions"
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


def _policy(training: dict[str, Any], env: gym.Env[Any, Any]) -> Any:
    """The network of a training, untrained. Raises InputError for none of ours."""
    try:
        settings = training["settings"]
        kind, given = ALGORITHMS[training["algorithm"]], arguments(settings)
        policy = kind.policy_aliases[settings["policy"]]
        network = given.get("policy_kwargs", {})
        check_network(network)
        return policy(env.observation_space, env.action_space, lambda _: 0.0, **network)
    except InputError:
        raise
    except Exception as error:  # torch raises many types
        raise InputError(f"not a policy of dynslam train ({one_line(repr(error))})") from None
