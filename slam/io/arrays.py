"""Read .npz files safely: no pickles, and a bound on the size of the arrays."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from slam.errors import InputError
from slam.geometry import Array
from slam.io.files import AnyPath, reading
from slam.io.one_line import one_line

MAX_BYTES = 1 << 33  # of all arrays
ALLOWED_BYTES = 1 << 28  # that any file may decompress to: arrays of zeros compress well
MAX_RATIO = 100  # times the compressed size, beyond that; readings compress to a half or a quarter
Parsed = TypeVar("Parsed")
UNREADABLE = (
    OSError, EOFError, ValueError, KeyError, TypeError, RuntimeError, MemoryError, OverflowError,
    SyntaxError, NotImplementedError, zlib.error, zipfile.BadZipFile,
)  # fmt: skip
"""What numpy and zipfile raise for files that are damaged or of another format."""


def read_arrays(path: AnyPath, what: str) -> dict[str, Any]:
    """All arrays of an .npz file by name. Raises InputError if it is not `what`."""
    with reading(path):
        pass
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(member.file_size for member in packed.infolist())
        if size > min(MAX_BYTES, max(ALLOWED_BYTES, MAX_RATIO * Path(path).stat().st_size)):
            raise InputError(f"{path}: not {what}, it unpacks to {size >> 20} MB")
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except InputError:
        raise
    except UNREADABLE as error:
        raise InputError(f"{path}: not {what} ({one_line(error)})") from error


def parsed(
    path: AnyPath, what: str, file_format: str, parse: Callable[[dict[str, Any]], Parsed]
) -> Parsed:
    """`parse` of the arrays of an .npz file whose array `format` is `file_format`. Raises
    InputError if it is not `what`."""
    data = read_arrays(path, what)
    try:
        if str(data["format"]) != file_format:
            raise InputError(f"format {one_line(data['format'], 60)}, expected {file_format}")
        return parse(data)
    except UNREADABLE as error:
        raise InputError(f"{path}: not {what} ({one_line(error)})") from error


def floats(values: Any, dimensions: int) -> Array:
    """Values as an array of float64. Raises InputError if they are not numbers."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf" or array.ndim != dimensions:
        raise InputError(
            f"an array of numbers with {dimensions} dimensions was expected, "
            f"got one of {array.dtype} with shape {array.shape}"
        )
    return array.astype(np.float64, copy=False)


def names(path: AnyPath) -> set[str]:
    """The names of the arrays in an .npz file. Raises InputError if it is not an .npz file."""
    try:
        with zipfile.ZipFile(path) as packed:
            return {name.removesuffix(".npy") for name in packed.namelist()}
    except UNREADABLE as error:
        raise InputError(f"{path}: not an .npz file ({one_line(error)})") from None
