"""Temporary files and folders beside the file that they become, which no killed process leaves for
ever: each is locked while it is written, and one that nobody holds is removed by the next writer of
that file."""

from __future__ import annotations

import os
import secrets
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: leftovers stay
    fcntl = None

ENDING = ".tmp"


@contextmanager
def temporary_file(path: Path) -> Iterator[Path]:
    """A new, empty file beside `path`; it is removed at the end if it is still there."""
    with _held(path, _new_file) as made:
        yield made


@contextmanager
def temporary_folder(path: Path) -> Iterator[Path]:
    """A new folder beside `path`; it is removed at the end."""
    with _held(path, _new_folder) as made:
        yield made


@contextmanager
def _held(path: Path, make: Callable[[Path], Path]) -> Iterator[Path]:
    sweep(path)
    made, handle = make(path), None
    try:
        while fcntl is not None:
            handle = os.open(made, os.O_RDONLY)
            fcntl.flock(handle, fcntl.LOCK_EX)
            if made.exists():  # nobody took it for a leftover before it was locked
                break
            os.close(handle)
            made, handle = make(path), None
        yield made
    finally:
        _remove(made)
        if handle is not None:
            os.close(handle)


def sweep(path: Path) -> None:
    """Remove temporary files and folders of `path` whose process has ended."""
    if fcntl is None or not path.parent.is_dir():
        return
    for name in os.listdir(path.parent):
        if name.startswith(f".{path.name}.") and name.endswith(ENDING):
            with suppress(OSError):  # held, or gone by now
                _remove_unless_held(path.parent / name)


def _remove_unless_held(found: Path) -> None:
    assert fcntl is not None
    handle = os.open(found, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        _remove(found)
    finally:
        os.close(handle)


def _remove(found: Path) -> None:
    if found.is_dir() and not found.is_symlink():
        shutil.rmtree(found, ignore_errors=True)
    else:
        found.unlink(missing_ok=True)


def _new_file(path: Path) -> Path:
    own = f"{os.getpid()}-{secrets.token_hex(4)}"  # process ids are not unique on a shared disk
    made = path.parent / f".{path.name}.{own}{ENDING}"
    made.touch(exist_ok=False)
    return made


def _new_folder(path: Path) -> Path:
    return Path(tempfile.mkdtemp(ENDING, f".{path.name}.", path.parent))
