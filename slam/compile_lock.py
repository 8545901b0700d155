"""One process compiles a kernel, others that need it wait and read what it has made.

Without it, processes that start together after an installation compile the same kernels, and an
entry that two add to numba's index at the same time is lost.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

NAME = "compiling.lock"  # a file beside the compiled kernels; each kernel is a byte of it

_held: set[tuple[str, int]] = set()  # folder and byte, by this process


@contextmanager
def compile_lock(folder: str, name: str) -> Iterator[None]:
    """Keep other processes from compiling the kernel `name`, whose compiled code lies in `folder`.

    The lock ends with its process. Where there are no locks (Windows, some disks on a network, a
    folder that cannot be written), and where waiting would never end, nothing is locked. Entered by
    one thread at a time: numba's own lock is held.
    """
    key = folder, zlib.crc32(name.encode())
    if key in _held or not _lock(*key):
        yield
        return
    _held.add(key)
    try:
        yield
    finally:
        _held.discard(key)
        _unlock(*key)


def _lock(folder: str, byte: int) -> bool:
    """Wait for the lock; whether there is one."""
    try:
        import fcntl

        fcntl.lockf(_file(folder), fcntl.LOCK_EX, 1, byte)
        return True
    except (ImportError, OSError):  # OSError: also two processes that would wait for each other
        return False


def _unlock(folder: str, byte: int) -> None:
    import fcntl

    with suppress(OSError):
        fcntl.lockf(_file(folder), fcntl.LOCK_UN, 1, byte)


@cache
def _file(folder: str) -> int:
    """The file of locks, open until the process ends: to close it would end all of them."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    return os.open(Path(folder) / NAME, os.O_RDWR | os.O_CREAT, 0o600)
