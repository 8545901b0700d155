"""The worlds of a vector environment with SameStep autoreset, with an info for each world.

Without stable-baselines3, whose import costs a worker process seconds and hundreds of megabytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from dynslam_env.registration import spec_of
from slam.errors import InputError
from slam.validation import instance

Info = dict[str, Any]
Step = tuple[NDArray[Any], NDArray[np.bool_], NDArray[np.bool_], Info]
"""Rewards (n), which episodes are terminated (n) and truncated (n), infos of all worlds."""


class SameStepWorlds:
    """Steps all worlds; a world whose episode ends is reset in the same step.

    env  a `gymnasium.vector.VectorEnv`, e.g. of `gym.make_vec(ID, n, autoreset_mode="SameStep")`
    """

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]):
        instance("env", env, gym.vector.VectorEnv)
        mode = env.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise InputError(
                "stable-baselines3 resets an environment in the step that ends its episode: "
                f'the vector environment needs autoreset_mode="SameStep", got {mode}'
            )
        self.env: Any = env

    @staticmethod
    def make(id: str, num_envs: int, **parameters: Any) -> SameStepWorlds:
        """`num_envs` environments named `id`, with the parameters of the environment.

        Without a native vector environment, they are stepped one after the other.
        """
        if spec_of(id).vector_entry_point is not None:
            parameters["autoreset_mode"] = "SameStep"
            return SameStepWorlds(gym.make_vec(id, num_envs, **parameters))
        mode = {"autoreset_mode": AutoresetMode.SAME_STEP}
        return SameStepWorlds(gym.make_vec(id, num_envs, "sync", vector_kwargs=mode, **parameters))

    def reset(self, seeds: Sequence[int | None]) -> tuple[Any, Info]:
        """Begin new episodes: observations and infos of all worlds, see `infos_of_worlds`."""
        return self.env.reset(seed=list(seeds))

    def step(self, actions: NDArray[Any]) -> tuple[Any, Step]:
        """Step by actions (n, 2): observations, and what else came of it, see `results`."""
        observations, *step = self.env.step(actions)
        return observations, tuple(step)


def results(
    step: Step,
) -> tuple[NDArray[np.float32], NDArray[np.bool_], list[Info], dict[int, Info]]:
    """Rewards (n), which episodes ended (n), the info of each world, and by world the info of each
    new episode's reset.

    The info of an ended episode holds its `terminal_observation`.
    """
    rewards, terminated, truncated, batch = step
    over, infos, fresh = terminated | truncated, [], {}
    for i, info in enumerate(infos_of_worlds(batch, len(over))):
        if over[i]:
            fresh[i] = {k: v for k, v in info.items() if not k.startswith("final_")}
            info = info["final_info"] | {"terminal_observation": info["final_obs"]}
        info["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        infos.append(info)
    return rewards.astype(np.float32), over, infos, fresh


def infos_of_worlds(batch: Info, n: int) -> list[Info]:
    """The info of each of n worlds, as its single environment would give it."""
    infos: list[Info] = [{} for _ in range(n)]
    for key, rows in batch.items():
        if key.startswith("_"):
            continue
        values = infos_of_worlds(rows, n) if isinstance(rows, dict) else _plain(rows)
        for info, valid, value in zip(infos, batch[f"_{key}"].tolist(), values, strict=True):
            if valid:
                info[key] = value
    return infos


def _plain(rows: NDArray[Any]) -> Sequence[Any]:
    """The rows; numbers are Python's own."""
    if isinstance(rows, np.ndarray) and rows.ndim == 1 and rows.dtype != object:
        return rows.tolist()
    return [row.item() if isinstance(row, np.generic) else row for row in rows]
