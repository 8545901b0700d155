"""Work that one of the processes of a test run does for all."""

import fcntl
import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from numba.core import event
from numba.core.dispatcher import Dispatcher

COMPILING = Path(tempfile.gettempdir()) / f"dynslam-compiling-{os.getuid()}.lock"


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Wait until no other process is within this block for the same `path`."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # until the file is closed
        yield


def compile_each_kernel_once() -> None:
    """While one process compiles, the others wait; then they find the kernel in numba's cache."""
    compiled, lock, depth = Dispatcher.compile, threading.RLock(), [0]

    def compile_alone(dispatcher: Any, signature: Any) -> Any:
        with lock:
            if depth[0]:  # a kernel that another one calls
                return compiled(dispatcher, signature)
            with event.trigger_event("numba:compiler_lock"), alone(COMPILING):  # waiting counts too
                depth[0] = 1
                try:
                    return compiled(dispatcher, signature)
                finally:
                    depth[0] = 0

    Dispatcher.compile = compile_alone  # type: ignore[method-assign]


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """The folder that `make` filled, in the first process of this test run that asks for it."""
    base = factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / name
    with alone(folder.with_suffix(".lock")):
        if not folder.with_suffix(".made").exists():
            folder.mkdir()
            make(folder)
            folder.with_suffix(".made").touch()
    return folder
