"""Ctrl-C deferred to the end of a step, so that no step is left half done."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def deferred_interrupt() -> Iterator[Callable[[], None]]:
    """Defer KeyboardInterrupt until the yielded function is called, between two steps.

    A second Ctrl-C interrupts at once. Inside a compiled kernel an interrupt would surface as
    another error.
    """
    asked = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True

    def between_steps() -> None:
        if asked:
            raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield between_steps  # signals come to the main thread alone
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield between_steps
    finally:
        signal.signal(signal.SIGINT, before)
