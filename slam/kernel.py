"""Compiled kernels: numba's `njit`, with a cache that is invalidated by edits in other files.

The time that compiling takes can be told apart from the time of the work itself: see `Stopwatch`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

from numba import njit
from numba.core.event import Listener, register
from numba.core.registry import CPUDispatcher


class Stopwatch(Listener):
    """Adds up the time of numba's events of one kind; an event within another counts once.

    seconds  s so far
    """

    def __init__(self, event: str):
        self.seconds = 0.0
        self._depth, self._begun = 0, 0.0
        register(event, self)

    def on_start(self, event: Any) -> None:
        """Called by numba at the begin of an event."""
        if not self._depth:
            self._begun = time.perf_counter()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """Called by numba at its end."""
        self._depth -= 1
        if not self._depth:
            self.seconds += time.perf_counter() - self._begun


COMPILING = Stopwatch("numba:compile")  # in this process
READYING = Stopwatch("numba:compiler_lock")  # the same, and reading compiled kernels from the disk


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile `function` by numba and keep the result on disk; `options` are those of `njit`.

    Numba recompiles a kernel when its own file was edited. This decorator also recompiles when an
    imported kernel, the value of an imported number, or the fields of an imported NamedTuple
    changed in another file. A kernel that takes a NamedTuple names it in its signature, and so
    imports it.
    """
    if function is None:
        return lambda kernel_function: kernel(kernel_function, **options)
    compiled: Any = njit(cache=True, **options)(function)
    if isinstance(compiled, CPUDispatcher):  # not under NUMBA_DISABLE_JIT
        index = _cache_index(compiled)
        index._source_stamp = (index._source_stamp, *_dependencies(function))
    return compiled


def _dependencies(function: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """The kernels, numbers and NamedTuples defined so far in the module of `function`."""
    for name, value in sorted(function.__globals__.items()):
        if isinstance(value, CPUDispatcher) and value.__module__ != function.__module__:
            yield name, _cache_index(value)._source_stamp
        elif isinstance(value, int | float):
            yield name, repr(value)
        elif isinstance(value, type) and issubclass(value, tuple):
            yield name, getattr(value, "_fields", ())


def _cache_index(compiled: Any) -> Any:
    """Numba's index file of the cache, which holds a stamp of the source."""
    return compiled._cache._cache_file
