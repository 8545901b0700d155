"""Ctrl-C that waits for the end of a step, so that nothing is left half done."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def deferred_interrupt() -> Iterator[Callable[[], None]]:
    """Gives what is to be called between two steps: it raises the KeyboardInterrupt that came in
    the meantime. Who presses Ctrl-C twice does not wait.

    Within a compiled kernel, an interrupt would come out as another error.
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
