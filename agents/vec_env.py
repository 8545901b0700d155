"""Adapter of the native vector environments to stable-baselines3. Needs `dynslam[train]`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

try:
    from stable_baselines3.common.vec_env import VecEnv
    from stable_baselines3.common.vec_env.base_vec_env import (
        VecEnvIndices,
        VecEnvObs,
        VecEnvStepReturn,
    )
except ImportError as error:
    raise ImportError("agents.vec_env needs stable-baselines3: install dynslam[train]") from error

from slam.errors import InputError
from slam.validation import instance

SHARED = "the worlds share one object, the vector environment `env`"


class NativeVecEnv(VecEnv):
    """A Gymnasium vector environment with SameStep autoreset as a stable-baselines3 VecEnv.

    Its results equal those of stable-baselines3's DummyVecEnv of as many single environments.

    ```python
    from stable_baselines3 import PPO
    import dynslam_env
    from agents.vec_env import NativeVecEnv

    env = NativeVecEnv.make("DoorOffice-v0", 16, laser=dynslam_env.Laser(beams=91), threads=2)
    PPO("MultiInputPolicy", env).learn(100_000)
    ```

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
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self.metadata = env.metadata
        self._actions: NDArray[Any] = np.empty(0)

    @staticmethod
    def make(id: str, num_envs: int, **parameters: Any) -> NativeVecEnv:
        """`num_envs` environments named `id`, with the parameters of the environment.

        Without a native vector environment, they are stepped one after the other.
        """
        if gym.spec(id).vector_entry_point is not None:
            parameters["autoreset_mode"] = "SameStep"
            return NativeVecEnv(gym.make_vec(id, num_envs, **parameters))
        mode = {"autoreset_mode": AutoresetMode.SAME_STEP}
        return NativeVecEnv(gym.make_vec(id, num_envs, "sync", vector_kwargs=mode, **parameters))

    def reset(self) -> VecEnvObs:
        """Begin new episodes, with the seeds set by `seed()`, if any."""
        if any(self._options):
            raise InputError("options belong to a single world: reset through `env`")
        observations, infos = self.env.reset(seed=self._seeds)
        self.reset_infos = [_single_info(infos, i) for i in range(self.num_envs)]
        self._reset_seeds()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions (n, 2) for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step all worlds; the info of an ended episode holds its `terminal_observation`."""
        observations, rewards, terminated, truncated, batch = self.env.step(self._actions)
        over, infos = terminated | truncated, []
        for i in range(self.num_envs):
            info = _single_info(batch, i)
            if over[i]:
                self.reset_infos[i] = {k: v for k, v in info.items() if not k.startswith("final_")}
                info = info["final_info"] | {"terminal_observation": info["final_obs"]}
            info["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
            infos.append(info)
        return observations, rewards.astype(np.float32), over, infos

    def close(self) -> None:
        """Close the worlds."""
        self.env.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """One image a world."""
        return self.env.render() or [None] * self.num_envs

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The vector environment's attribute, once a world."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refused: the worlds share one object."""
        raise InputError(f"cannot set {attr_name!r}: {SHARED}")

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Refused: the worlds share one object."""
        raise InputError(f"cannot call {method_name!r}: {SHARED}")

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """No single world is wrapped."""
        return [False for _ in self._get_indices(indices)]


def _single_info(infos: dict[str, Any], i: int) -> dict[str, Any]:
    """The info of world `i`, as its single environment would give it."""
    mine = {}
    for key, rows in infos.items():
        if key.startswith("_") or not infos[f"_{key}"][i]:
            continue
        value = _single_info(rows, i) if isinstance(rows, dict) else rows[i]
        mine[key] = value.item() if isinstance(value, np.generic) else value
    return mine
