"""Compiled kernels: numba's `njit`, with a cache that notices edits in other files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from numba import njit
from numba.core.registry import CPUDispatcher


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile `function` by numba and keep the result on disk; `options` are those of `njit`.

    Numba compiles again when the kernel's own file was edited. This does so, too, when an imported
    kernel was edited, or the value of an imported number, in whatever file.
    """
    if function is None:
        return lambda kernel_function: kernel(kernel_function, **options)
    compiled: Any = njit(cache=True, **options)(function)
    if isinstance(compiled, CPUDispatcher):  # not under NUMBA_DISABLE_JIT
        index = _cache_index(compiled)
        index._source_stamp = (index._source_stamp, *_dependencies(function))
    return compiled


def _dependencies(function: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """The kernels and numbers that the module of `function` has imported or computed so far."""
    for name, value in sorted(function.__globals__.items()):
        if isinstance(value, CPUDispatcher) and value.__module__ != function.__module__:
            yield name, _cache_index(value)._source_stamp
        elif isinstance(value, int | float):
            yield name, repr(value)


def _cache_index(compiled: Any) -> Any:
    """numba's file of what is in the cache, and of the source that it was compiled from."""
    return compiled._cache._cache_file
