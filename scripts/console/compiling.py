"""Tell that kernels are compiled: those that no run since the installation has needed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core.event import Listener, install_listener

NOTE = "compiling kernels that were not needed before: one to two minutes if it is all of them ..."


class _Teller(Listener):
    """Writes NOTE at the first kernel that has to be compiled."""

    def __init__(self) -> None:
        self._told = False

    def on_start(self, event: Any) -> None:
        """Called by numba when it begins to compile."""
        if not self._told:
            print(NOTE, file=sys.stderr, flush=True)
        self._told = True

    def on_end(self, event: Any) -> None:
        """Called by numba when it has compiled."""


@contextmanager
def compiling_told() -> Iterator[None]:
    """Within this block, the first kernel that has to be compiled is told on standard error.

    Kernels that are read from the cache on disk are not.
    """
    with install_listener("numba:compile", _Teller()):
        yield
