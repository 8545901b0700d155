"""Memory of the process, as the C library manages it."""

from __future__ import annotations

import ctypes
from contextlib import suppress


def give_back() -> None:
    """Give memory that is free back to the system. The C library keeps most of it for what comes
    next, but in pieces, as a map left them, which are too small for large arrays."""
    with suppress(AttributeError, OSError, TypeError):  # a C library other than glibc
        ctypes.CDLL(None).malloc_trim(0)
