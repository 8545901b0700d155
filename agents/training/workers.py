"""Workers: a native vector environment whose worlds are divided among processes."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any

import cloudpickle
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import (
    VecEnvIndices,
    VecEnvObs,
    VecEnvStepReturn,
)

from agents.same_step import SameStepWorlds, infos_of_worlds, results
from agents.training.worker_process import Block, serve
from agents.vec_env import SHARED
from slam.errors import InputError
from slam.validation import whole_number

Parameters = dict[str, Any]


class Workers(VecEnv):
    """`NativeVecEnv.make(id, num_envs)` in several processes, with the same results.

    Observations lie in shared memory. If a worker dies, the next call raises RuntimeError.

    id          of an environment with a native vector environment and a Dict to observe
    num_envs    worlds; a multiple of `workers`
    workers     processes
    parameters  keywords of the environment; sent to the processes by cloudpickle
    """

    def __init__(self, id: str, num_envs: int, workers: int, parameters: Parameters):
        whole_number("workers", workers, 1)
        if num_envs % workers:
            raise InputError(
                f"worlds are divided equally: num_envs must be a multiple of workers, "
                f"got {num_envs} and {workers}"
            )
        each, context = num_envs // workers, get_context("spawn")
        first = SameStepWorlds.make(id, 1, **parameters).env  # raises here for wrong parameters
        first.close()
        space = first.single_observation_space
        assert isinstance(space, spaces.Dict)
        self._blocks = {
            key: Block((num_envs, *(box.shape or ())), box.dtype) for key, box in space.items()
        }
        self._pipes: list[Connection] = []
        self._processes: list[SpawnProcess] = []
        for k in range(workers):
            ours, theirs = context.Pipe()
            rows = slice(k * each, (k + 1) * each)
            specs = {n: b.spec for n, b in self._blocks.items()}
            made = id, each, cloudpickle.dumps(parameters), rows, specs
            process = context.Process(target=serve, args=(theirs, *made), daemon=True)
            process.start()
            theirs.close()
            self._pipes.append(ours)
            self._processes.append(process)
        self._each, self._closed, self.render_mode = each, False, None
        super().__init__(num_envs, space, first.single_action_space)

    def reset(self) -> VecEnvObs:
        """Begin new episodes, with the seeds set by `seed()`, if any."""
        if any(self._options):
            raise InputError(f"options belong to a single world: {SHARED}")
        self._send("reset", self._divided(self._seeds))
        each = self._each
        self.reset_infos = [one for all_ in self._receive() for one in infos_of_worlds(all_, each)]
        self._reset_seeds()
        return self._observations()

    def step_async(self, actions: NDArray[Any]) -> None:
        """Let all workers step their worlds by actions (n, 2)."""
        self._send("step", self._divided(actions))

    def step_wait(self) -> VecEnvStepReturn:
        """Wait for them; see `NativeVecEnv.step_wait`."""
        rewards, over, infos = [], [], []
        for k, step in enumerate(self._receive()):
            *mine, fresh = results(step)
            for all_, part in zip((rewards, over, infos), mine, strict=True):
                all_.extend(part)
            for i, info in fresh.items():
                self.reset_infos[k * self._each + i] = info
        return self._observations(), np.array(rewards, np.float32), np.array(over), infos

    def close(self) -> None:
        """End the processes."""
        if self._closed:
            return
        self._closed = True
        for pipe in self._pipes:
            with contextlib.suppress(OSError):
                pipe.send(("close", None))
        for process in self._processes:
            process.join(5.0)
            process.kill()
        for block in self._blocks.values():
            block.free()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """This object's attribute, once a world."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refused: the worlds share one object."""
        raise InputError(f"cannot set {attr_name!r}: {SHARED}")

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Refused: the worlds share one object."""
        raise InputError(f"cannot call {method_name!r}: {SHARED}")

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """No single world is wrapped."""
        return [False for _ in self._get_indices(indices)]

    def _observations(self) -> dict[str, NDArray[Any]]:
        return {key: block.array.copy() for key, block in self._blocks.items()}

    def _divided(self, rows: Sequence[Any] | NDArray[Any]) -> list[Any]:
        return [rows[k : k + self._each] for k in range(0, self.num_envs, self._each)]

    def _send(self, command: str, each: list[Any]) -> None:
        for pipe, mine in zip(self._pipes, each, strict=True):
            try:
                pipe.send((command, mine))
            except OSError:
                raise RuntimeError("a worker of the vector environment died") from None

    def _receive(self) -> list[Any]:
        answers = []
        for pipe in self._pipes:  # all of them before an error is raised: no answer stays in a pipe
            try:
                answers.append(pipe.recv())
            except (EOFError, OSError):
                raise RuntimeError("a worker of the vector environment died") from None
        for error, _ in answers:
            if error is not None:
                raise error
        return [answer for _, answer in answers]
