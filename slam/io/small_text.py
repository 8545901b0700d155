"""Small text files that a person wrote, such as a suite: UTF-8, of bounded size."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from slam.errors import InputError
from slam.io.files import AnyPath, reading
from slam.io.guard import guarded
from slam.io.one_line import one_line

MAX_BYTES = 1 << 20  # of a file that a person writes
Parsed = TypeVar("Parsed")


def read_text(path: AnyPath, most: int = MAX_BYTES) -> str:
    """The text of a file of at most `most` bytes. Raises InputError for a larger one, for what is
    no file, and for another encoding than UTF-8."""
    with guarded(path), reading(path) as file:
        data = file.read(most + 1)
        if len(data) > most:
            raise InputError(f"expected a small file, this has more than {most >> 10} kB")
        try:
            return data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise InputError(f"expected a text in UTF-8, byte {error.start} is not") from None


def parse_text(
    path: AnyPath, what: str, parse: Callable[[str], Parsed], most: int = MAX_BYTES
) -> Parsed:
    """`parse` of the text of a file. Raises InputError that says that it is not `what`, for
    whatever ValueError it raises, and for data nested too deeply."""
    text = read_text(path, most)
    with guarded(path):
        try:
            return parse(text)
        except InputError:
            raise
        except (ValueError, TypeError, LookupError, OverflowError, AttributeError) as error:
            raise InputError(f"not {what} ({one_line(error)})") from None
