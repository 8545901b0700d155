"""Compiled kernels: numba's `njit`, with a cache that is invalidated by edits in other files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from numba import njit
from numba.core.registry import CPUDispatcher


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
