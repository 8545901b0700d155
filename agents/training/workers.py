"""Workers: one native vector environment, its worlds divided among processes."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import (
    VecEnvIndices,
    VecEnvObs,
    VecEnvStepReturn,
)

from agents.vec_env import SHARED, NativeVecEnv
from slam.errors import InputError
from slam.validation import whole_number

Parameters = dict[str, Any]


class Workers(VecEnv):
    """`NativeVecEnv.make(id, num_envs)`, in so many processes; what comes out is the same.

    Observations lie in memory that all processes share. A worker that dies is told as an error.

    id          of an environment with a native vector environment and a Dict to observe
    num_envs    worlds; a multiple of `workers`
    workers     processes
    parameters  of the environment
    """

    def __init__(self, id: str, num_envs: int, workers: int, parameters: Parameters):
        whole_number("workers", workers, 1)
        if num_envs % workers:
            raise InputError(
                f"worlds are divided equally: num_envs must be a multiple of workers, "
                f"got {num_envs} and {workers}"
            )
        each, context = num_envs // workers, get_context("spawn")
        first = NativeVecEnv.make(id, 1, **parameters)  # a mistake is told here
        first.close()
        space = first.observation_space
        assert isinstance(space, spaces.Dict)
        self._blocks = {
            key: _Block((num_envs, *(box.shape or ())), box.dtype) for key, box in space.items()
        }
        self._pipes: list[Connection] = []
        self._processes: list[SpawnProcess] = []
        for k in range(workers):
            ours, theirs = context.Pipe()
            rows = slice(k * each, (k + 1) * each)
            made = id, each, parameters, rows, {n: b.told for n, b in self._blocks.items()}
            process = context.Process(target=_work, args=(theirs, *made), daemon=True)
            process.start()
            theirs.close()
            self._pipes.append(ours)
            self._processes.append(process)
        self._each, self._closed, self.render_mode = each, False, None
        super().__init__(num_envs, space, first.action_space)

    def reset(self) -> VecEnvObs:
        """Begin new episodes; with the seeds that `seed()` set, if it did."""
        if any(self._options):
            raise InputError(f"options are those of one world: {SHARED}")
        self._ask("reset", self._divided(self._seeds))
        self.reset_infos = [info for infos in self._hear() for info in infos]
        self._reset_seeds()
        return self._observations()

    def step_async(self, actions: NDArray[Any]) -> None:
        """Let all workers step their worlds by actions (n, 2)."""
        self._ask("step", self._divided(actions))

    def step_wait(self) -> VecEnvStepReturn:
        """Wait for them; see `NativeVecEnv.step_wait`."""
        rewards, over, infos, fresh = [], [], [], []
        for mine in self._hear():
            for all_, part in zip((rewards, over, infos, fresh), mine, strict=True):
                all_.extend(part)
        self.reset_infos = fresh
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

    def _ask(self, what: str, each: list[Any]) -> None:
        for pipe, mine in zip(self._pipes, each, strict=True):
            try:
                pipe.send((what, mine))
            except OSError:
                raise RuntimeError("a worker of the vector environment died") from None

    def _hear(self) -> list[Any]:
        heard = []
        for pipe in self._pipes:  # all of them, before an error is told: no answer waits for ever
            try:
                heard.append(pipe.recv())
            except (EOFError, OSError):
                raise RuntimeError("a worker of the vector environment died") from None
        for error, _ in heard:
            if error is not None:
                raise error
        return [answer for _, answer in heard]


Told = tuple[str, tuple[int, ...], str]


class _Block:
    """An array in memory that processes share."""

    def __init__(self, shape: tuple[int, ...], dtype: Any, name: str | None = None):
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        self._memory = SharedMemory(name, create=name is None, size=size)
        self.array = np.ndarray(shape, dtype, self._memory.buf)
        self.told: Told = (self._memory.name, shape, np.dtype(dtype).str)

    def free(self) -> None:
        """Give it back, for all processes."""
        del self.array
        self._memory.close()
        self._memory.unlink()


def _work(
    pipe: Connection, id: str, n: int, parameters: Parameters, rows: slice, told: dict[str, Told]
) -> None:
    """A worker: does what it is asked until it is closed, or until nobody is left to ask."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one who asks
    blocks = {key: _Block(shape, dtype, name) for key, (name, shape, dtype) in told.items()}
    env = NativeVecEnv.make(id, n, **parameters)
    with contextlib.suppress(EOFError, OSError):
        while True:
            what, given = pipe.recv()
            if what == "close":
                return
            try:
                answer = _reset(env, given, blocks, rows) if what == "reset" else None
                if what == "step":
                    answer = _step(env, given, blocks, rows)
                pipe.send((None, answer))
            except Exception as error:
                pipe.send((error, None))


def _show(observation: Any, blocks: dict[str, _Block], rows: slice) -> None:
    for key, block in blocks.items():
        block.array[rows] = observation[key]


def _reset(env: NativeVecEnv, seeds: list[Any], blocks: dict[str, _Block], rows: slice) -> Any:
    env._seeds = list(seeds)
    _show(env.reset(), blocks, rows)
    return env.reset_infos


def _step(env: NativeVecEnv, actions: Any, blocks: dict[str, _Block], rows: slice) -> Any:
    env.step_async(actions)
    observations, rewards, over, infos = env.step_wait()
    _show(observations, blocks, rows)
    return rewards.tolist(), over.tolist(), infos, env.reset_infos
