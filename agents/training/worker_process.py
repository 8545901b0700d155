"""A worker process: some of the worlds of `Workers`. It imports neither torch nor
stable-baselines3."""

from __future__ import annotations

import contextlib
import signal
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import cloudpickle
import numpy as np

from agents.same_step import SameStepWorlds

BlockSpec = tuple[str, tuple[int, ...], str]  # name, shape, type


class Block:
    """An array in shared memory."""

    def __init__(self, shape: tuple[int, ...], dtype: Any, name: str | None = None):
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        self._memory = SharedMemory(name, create=name is None, size=size)
        self.array = np.ndarray(shape, dtype, self._memory.buf)
        self.spec: BlockSpec = (self._memory.name, shape, np.dtype(dtype).str)

    def free(self) -> None:
        """Release the memory, for all processes."""
        del self.array
        self._memory.close()
        self._memory.unlink()


def serve(
    pipe: Connection, id: str, n: int, parameters: bytes, rows: slice,
    specs: dict[str, BlockSpec],
) -> None:  # fmt: skip
    """A worker: executes commands until it is closed or its parent has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    blocks = {key: Block(shape, dtype, name) for key, (name, shape, dtype) in specs.items()}
    worlds = SameStepWorlds.make(id, n, **cloudpickle.loads(parameters))
    with contextlib.suppress(EOFError, OSError):
        while True:
            command, given = pipe.recv()
            if command == "close":
                return
            try:
                act = worlds.reset if command == "reset" else worlds.step
                observations, answer = act(given)
                for key, block in blocks.items():
                    block.array[rows] = observations[key]
                pipe.send((None, answer))
            except Exception as error:
                pipe.send((error, None))
