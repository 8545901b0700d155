"""The guard of all readers: errors name the file, and memory is in proportion to its size.

A small file can unpack to a large one, or hold millions of scans of one beam. A reader therefore
takes what it is about to allocate from the budget of its file, which is `FLOOR` and `PER_BYTE`
times its size; $DYNSLAM_READ_MB raises the floor.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from slam.errors import InputError
from slam.io.one_line import one_line

FLOOR = 200  # MB, of any file
PER_BYTE = 50  # bytes of memory for a byte of a file
VARIABLE = "DYNSLAM_READ_MB"
MAX_MESSAGE = 400  # characters, beside the path and
LINE_NUMBER = 20  # of a line number and a colon
SCAN_BYTES = 1500  # of a scan's objects, beside its ranges
RECORD_BYTES = 600  # of a line, a message or a pose that is kept as an object

_left: ContextVar[list[float] | None] = ContextVar("left", default=None)


@contextmanager
def guarded(path: str | os.PathLike[str]) -> Iterator[None]:
    """Read the file, or the folder of files, at `path` within its budget; within that of another
    file, as of the map whose picture this is, that one counts. Raises InputError that begins with
    the path, also for nested data too deep and for memory that is not there."""
    outer = _left.get()
    token = _left.set([allowance(Path(path))] if outer is None else outer)
    try:
        yield
    except InputError as error:
        raise InputError(_told(path, str(error))) from None
    except RecursionError:
        raise InputError(f"{path}: is nested too deeply") from None
    except MemoryError:
        raise InputError(f"{path}: there is not enough memory to read it") from None
    finally:
        _left.reset(token)


def _told(path: str | os.PathLike[str], text: str) -> str:
    """The message, short, behind the path; behind path:line if that is what it begins with."""
    if not text.startswith(str(path)):
        return f"{path}: {one_line(text, MAX_MESSAGE)}"
    return f"{path}{one_line(text.removeprefix(str(path)), MAX_MESSAGE + LINE_NUMBER)}"


def take(size: float) -> None:
    """Count `size` bytes that are about to be allocated. Raises InputError if the file being read
    is too small for so much; nothing outside of `guarded`."""
    left = _left.get()
    if left is None:
        return
    left[0] -= size
    if left[0] < 0:
        raise InputError(
            f"takes more memory than files of its size ({FLOOR} MB and {PER_BYTE} times the "
            f"size); if that is right, {VARIABLE}=MB allows more"
        )


def allow(path: Path) -> None:
    """Add to the budget of the file being read PER_BYTE times the size of one that belongs to it;
    nothing outside of `guarded`."""
    left = _left.get()
    if left is not None:
        left[0] += PER_BYTE * _size(path)


def allowance(path: Path) -> float:
    """Bytes that reading the file or folder at `path` may take."""
    return 1e6 * _floor() + PER_BYTE * _size(path)


def _floor() -> float:
    try:
        given = float(os.environ.get(VARIABLE, FLOOR))
    except ValueError:
        given = math.nan
    if not 0 <= given < math.inf:
        raise InputError(f"{VARIABLE} must be a number of MB, got {os.environ[VARIABLE]!r}")
    return given


def _size(path: Path) -> int:
    """Bytes of a file, or of the files in a folder; 0 where there is none."""
    try:
        if path.is_dir():
            return sum(one.stat().st_size for one in path.iterdir() if one.is_file())
        return path.stat().st_size
    except (OSError, ValueError):  # told when it is opened
        return 0
