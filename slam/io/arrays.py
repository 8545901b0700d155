"""Read .npz files safely: no pickles, and arrays within the budget of the file."""

from __future__ import annotations

import math
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np

from slam.errors import InputError
from slam.geometry import Array
from slam.io.archive import check_packing
from slam.io.files import AnyPath, reading
from slam.io.guard import guarded, take
from slam.io.one_line import one_line

FLOAT_BYTES = 8  # of a number, as which every array may be used
ARCHIVE = b"PK\x03\x04"  # the beginning of an .npz file
COPIES = 3  # of an array: as it is stored, as floats, and what is computed from it
Parsed = TypeVar("Parsed")
UNREADABLE = (
    OSError, EOFError, ValueError, LookupError, TypeError, RuntimeError, MemoryError, OverflowError,
    SyntaxError, SystemError, AttributeError, zlib.error, zipfile.BadZipFile, tokenize.TokenError,
)  # fmt: skip
"""What numpy, json and zipfile raise for files that are damaged or of another format; LookupError
is KeyError and IndexError, RuntimeError is RecursionError and NotImplementedError."""


def read_arrays(path: AnyPath, what: str, number_bytes: int = FLOAT_BYTES) -> dict[str, Any]:
    """All arrays of an .npz file by name; `number_bytes`: of a number, at least, as it is used.
    Raises InputError if it is not `what`."""
    with guarded(path), _only(what):
        _whole(path)
        with zipfile.ZipFile(path) as packed:
            check_packing(packed)
            for member in packed.infolist():
                take(_planned(packed, member, number_bytes))
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}


def _whole(path: AnyPath) -> None:
    """Raise InputError for an .npz file without its end."""
    with reading(path) as file:
        begun = file.read(len(ARCHIVE)) == ARCHIVE
    if begun and not zipfile.is_zipfile(path):
        raise InputError("its end is missing: it was cut off")


@contextmanager
def _only(what: str) -> Iterator[None]:
    """Whatever is raised for another file, as InputError."""
    try:
        yield
    except UNREADABLE as error:
        raise InputError(f"not {what} ({one_line(error)})") from error


def _planned(packed: zipfile.ZipFile, member: zipfile.ZipInfo, number_bytes: int) -> float:
    """Bytes that an array takes, by the head of its file; raises what numpy does for another."""
    with packed.open(member) as file:
        if file.read(len(np.lib.format.MAGIC_PREFIX)) != np.lib.format.MAGIC_PREFIX:
            raise InputError(f"{one_line(member.filename, 60)} in it is no array of numpy")
        first = tuple(file.read(2)) == (1, 0)
        formats = np.lib.format
        read = formats.read_array_header_1_0 if first else formats.read_array_header_2_0
        shape, _, kind = read(file)
    if min(shape, default=0) < 0:
        raise InputError(f"{member.filename} announces the shape {shape}")
    return COPIES * max(kind.itemsize, number_bytes) * math.prod(shape)


def parsed(
    path: AnyPath,
    what: str,
    file_format: str,
    parse: Callable[[dict[str, Any]], Parsed],
    number_bytes: int = FLOAT_BYTES,
) -> Parsed:
    """`parse` of the arrays of an .npz file whose array `format` is `file_format`; see
    `read_arrays`. Raises InputError if it is not `what`."""
    with guarded(path):
        data = read_arrays(path, what, number_bytes)
        with _only(what):
            if str(data["format"]) != file_format:
                raise InputError(f"format {one_line(data['format'], 60)}, expected {file_format}")
            return parse(data)


def floats(values: Any, dimensions: int) -> Array:
    """Values as an array of float64. Raises InputError if they are not numbers."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf" or array.ndim != dimensions:
        raise InputError(
            f"an array of numbers with {dimensions} dimensions was expected, "
            f"got one of {array.dtype} with shape {array.shape}"
        )
    return array.astype(np.float64, copy=False)


def numbers(values: Any, shape: tuple[int, ...]) -> Array:
    """Values as an array of float64 of this shape. Raises InputError for others, before a list is
    made of them."""
    array = floats(values, len(shape))
    if array.shape != shape:
        raise InputError(f"an array of shape {shape} was expected, got one of {array.shape}")
    return array


def names(path: AnyPath) -> set[str]:
    """The names of the arrays in an .npz file. Raises InputError if it is not an .npz file."""
    try:
        _whole(path)
        with zipfile.ZipFile(path) as packed:
            return {name.removesuffix(".npy") for name in packed.namelist()}
    except (InputError, *UNREADABLE) as error:
        raise InputError(f"{path}: not an .npz file ({one_line(error)})") from None
