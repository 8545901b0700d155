"""Read lines of plain or gzip text; write files that appear only when they are complete."""

from __future__ import annotations

import gzip
import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import IO

from slam.errors import InputError
from slam.io.guard import take
from slam.io.leftovers import temporary_file, temporary_folder

AnyPath = str | os.PathLike[str]
MAX_LINE = 1 << 20  # bytes; the rest of a longer line is left out
MAX_TEXT_LINE = 1 << 26  # bytes; a file with a longer line is no text
MAX_LISTED = 1000  # names of a folder that are compared with one that is not there
LINE_BYTES = 100  # of memory that a line of a text may take, beside its bytes
GZIP_MAGIC = b"\x1f\x8b"  # the first bytes of a gzip file
ZIP_MAGIC = b"PK\x03\x04"
ROS1_MAGIC = b"#ROSBAG V"
MCAP_MAGIC = b"\x89MCAP0\r\n"
SQLITE_MAGIC = b"SQLite format 3\0"


class CutShortError(InputError):
    """A compressed file ends early or is damaged; the lines before were good."""


def lines(path: AnyPath) -> Iterator[tuple[int, bytes]]:
    """Line numbers (from 1) and lines of a text file, compressed or not, in bounded memory.

    What a compressed one unpacks to is taken from its budget. Raises InputError if the file cannot
    be opened, CutShortError if a compressed one is damaged.
    """
    with reading(path) as raw:
        packed = raw.peek(2)[:2] == GZIP_MAGIC  # pyright: ignore[reportAttributeAccessIssue]
        file = gzip.GzipFile(fileobj=raw) if packed else raw
        number, whole, length = 0, True, 0
        try:
            while line := file.readline(MAX_LINE):
                take(len(line) + LINE_BYTES if packed else 0)
                if whole:
                    number, length = number + 1, 0
                    yield number, line
                length += len(line)
                if length > MAX_TEXT_LINE:
                    raise InputError(
                        f"{path}:{number}: a line of over {MAX_TEXT_LINE >> 20} MB, as no log has"
                    )
                whole = len(line) < MAX_LINE or line.endswith(b"\n")
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise CutShortError(
                f"{path}:{number + 1}: a complete gzip file was expected, this one is "
                f"cut short or damaged ({error})"
            ) from None


def text_lines(path: AnyPath) -> Iterator[tuple[int, str]]:
    """Line numbers and stripped lines as text, without blank lines and comments (#)."""
    for number, line in lines(path):
        text = line.decode(errors="replace").strip()
        if text and not text.startswith("#"):
            yield number, text


@contextmanager
def reading(path: AnyPath) -> Iterator[IO[bytes]]:
    """A file open for reading. Raises InputError if the system refuses it, and for a pipe or a
    device, which might never end."""
    try:
        path = _named(path)
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise InputError(f"{path}: a file was expected, this is a device or a pipe")
        with path.open("rb") as file:
            yield file
    except FileNotFoundError:
        raise InputError(f"{path}: no such file{_near_names(Path(path))}") from None
    except IsADirectoryError:
        raise InputError(f"{path}: a file was expected, this is a directory") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None


def _near_names(path: Path) -> str:
    """Which files of the folder have a name like this one's; empty if none has."""
    try:
        with os.scandir(path.parent) as folder:
            names = [one.name for one in islice(folder, MAX_LISTED)]
    except OSError:
        return ""
    near = get_close_matches(path.name, names)
    return f"; did you mean {', '.join(near)}?" if near else ""


@contextmanager
def replacing(path: AnyPath) -> Iterator[IO[bytes]]:
    """A temporary file that replaces `path` when it is complete, and is deleted otherwise."""
    path = _named(path)
    try:
        with temporary_file(path) as temporary:
            with temporary.open("wb") as file:
                yield file
            temporary.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None


@contextmanager
def placing(path: AnyPath) -> Iterator[Path]:
    """A temporary path with the same name, for libraries that open files by name; the file written
    there then replaces `path`."""
    path = _named(path)
    try:
        with temporary_folder(path) as folder:
            made = folder / path.name
            yield made
            made.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None


def _named(path: AnyPath) -> Path:
    if "\0" in str(path):
        raise InputError(f"{str(path)!r}: not a file name")
    return Path(path)
