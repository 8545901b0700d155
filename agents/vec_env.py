"""Adapter of the native vector environments to stable-baselines3. Needs `dynslam[train]`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
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

from agents.same_step import SameStepWorlds, infos_of_worlds, results
from slam.errors import InputError

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
        self._worlds = SameStepWorlds(env)
        self.env: Any = env
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self.metadata = env.metadata
        self._actions: NDArray[Any] = np.empty(0)

    @staticmethod
    def make(id: str, num_envs: int, **parameters: Any) -> NativeVecEnv:
        """`num_envs` environments named `id`, with the parameters of the environment.

        Without a native vector environment, they are stepped one after the other.
        """
        return NativeVecEnv(SameStepWorlds.make(id, num_envs, **parameters).env)

    def reset(self) -> VecEnvObs:
        """Begin new episodes, with the seeds set by `seed()`, if any."""
        if any(self._options):
            raise InputError("options belong to a single world: reset through `env`")
        observations, infos = self._worlds.reset(self._seeds)
        self.reset_infos = infos_of_worlds(infos, self.num_envs)
        self._reset_seeds()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions (n, 2) for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step all worlds; the info of an ended episode holds its `terminal_observation`."""
        observations, step = self._worlds.step(self._actions)
        rewards, over, infos, fresh = results(step)
        for i, info in fresh.items():
            self.reset_infos[i] = info
        return observations, rewards, over, infos

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
