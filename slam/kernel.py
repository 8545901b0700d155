"""Compiled kernels: numba's `njit`, with a cache that is invalidated by edits in other files.

The time that compiling takes can be told apart from the time of the work itself: see `Stopwatch`.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from numba import config, njit
from numba.core.compiler_lock import global_compiler_lock
from numba.core.event import Listener, register
from numba.core.registry import CPUDispatcher

from slam.compile_lock import compile_lock
from slam.temporary import is_writable, own_folder, provide_home

provide_home()


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
    compiled = _compiled(function, options)
    index = _cache_index(compiled)
    if index is not None:
        index._source_stamp = (index._source_stamp, *_dependencies(function))
        _compile_once(compiled, index)
    return compiled


def _compiled(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """The kernel, its cache beside the source or where numba is told to keep it; where neither can
    be written, in a temporary folder of this user; where nothing can, without a cache."""
    try:
        return njit(cache=True, **options)(function)
    except RuntimeError:  # numba's "no locator available"
        if not _move_cache():
            return njit(**options)(function)
    return njit(cache=True, **options)(function)


def _move_cache() -> bool:
    """Let numba, here and in processes that this one starts, keep its files in a temporary folder;
    says so. False if that is impossible."""
    try:
        folder = str(own_folder() / "numba")
    except OSError:
        return False
    settings: Any = config
    if folder == settings.CACHE_DIR:  # and it cannot be written any more
        return False
    print(
        f"dynslam: compiled code is kept in {folder}, because neither the package's folder nor the "
        f"user's own can be written; NUMBA_CACHE_DIR names another",
        file=sys.stderr,
    )
    settings.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"] = folder
    return is_writable(Path(folder))


def _compile_once(compiled: Any, index: Any) -> None:
    """Let the kernel be compiled by one process at a time; the others then find it on the disk."""
    of_numba = compiled.compile

    def compile_signature(signature: Any) -> Any:
        with global_compiler_lock, compile_lock(index._cache_path, index._index_name):
            return of_numba(signature)

    compiled.compile = compile_signature


def _dependencies(function: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """The kernels, numbers and NamedTuples defined so far in the module of `function`."""
    for name, value in sorted(function.__globals__.items()):
        if isinstance(value, CPUDispatcher) and value.__module__ != function.__module__:
            yield name, getattr(_cache_index(value), "_source_stamp", None)
        elif isinstance(value, int | float):
            yield name, repr(value)
        elif isinstance(value, type) and issubclass(value, tuple):
            yield name, getattr(value, "_fields", ())


def _cache_index(compiled: Any) -> Any:
    """Numba's index file of the cache, which holds a stamp of the source; None without a cache, and
    under NUMBA_DISABLE_JIT."""
    return getattr(getattr(compiled, "_cache", None), "_cache_file", None)
