"""Calls spread over threads; the caller's is one of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait


class Threads:
    """`count` threads, of which the caller's is one."""

    def __init__(self, count: int):
        self._count = count
        self._pool = ThreadPoolExecutor(count - 1) if count > 1 else None

    def each(self, call: Callable[[int], None], rows: Sequence[int]) -> None:
        """Call `call(i)` for all `rows`, in no order between threads; an error is raised again.

        Whatever happens, no call is under way any more when this returns.
        """
        if self._pool is None:
            return _in_turn(call, rows)
        parts = [rows[k :: self._count] for k in range(self._count)]
        others = [self._pool.submit(_in_turn, call, part) for part in parts[1:] if part]
        try:
            _in_turn(call, parts[0])
        finally:
            wait(others)
        for other in others:
            other.result()

    def close(self) -> None:
        """Let the threads go; nothing can be called any more."""
        if self._pool is not None:
            self._pool.shutdown()


def _in_turn(call: Callable[[int], None], rows: Sequence[int]) -> None:
    for i in rows:
        call(i)
