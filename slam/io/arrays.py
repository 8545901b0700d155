"""Named arrays out of an .npz file that may be anything: no pickle, and no more than fits."""

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

LARGEST = 1 << 33  # bytes of all arrays
FLOOR = 1 << 28  # bytes that any file may unpack to: arrays of zeros pack well
TIMES = 100  # times as large as packed beyond that: readings pack to a half or a quarter
Parsed = TypeVar("Parsed")
UNREADABLE = (
    OSError, EOFError, ValueError, KeyError, TypeError, RuntimeError, MemoryError, OverflowError,
    SyntaxError, NotImplementedError, zlib.error, zipfile.BadZipFile,
)  # fmt: skip
"""What numpy and zipfile raise for files that are damaged or something else."""


def read_arrays(path: AnyPath, what: str) -> dict[str, Any]:
    """All arrays of an .npz file by name. Raises InputError where it is no `what`."""
    with reading(path):
        pass
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(member.file_size for member in packed.infolist())
        if size > min(LARGEST, max(FLOOR, TIMES * Path(path).stat().st_size)):
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
    InputError where it is no `what`."""
    data = read_arrays(path, what)
    try:
        if str(data["format"]) != file_format:
            raise InputError(f"format {one_line(data['format'], 60)}, expected {file_format}")
        return parse(data)
    except UNREADABLE as error:
        raise InputError(f"{path}: not {what} ({one_line(error)})") from error


def floats(values: Any, dimensions: int) -> Array:
    """Numbers as they are reckoned with. Raises ValueError or TypeError where they are none."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf" or array.ndim != dimensions:
        raise InputError(
            f"an array of numbers with {dimensions} dimensions was expected, "
            f"got one of {array.dtype} with shape {array.shape}"
        )
    return array.astype(np.float64, copy=False)


def names(path: AnyPath) -> set[str]:
    """The names of the arrays in an .npz file. Raises InputError where it is none."""
    try:
        with zipfile.ZipFile(path) as packed:
            return {name.removesuffix(".npy") for name in packed.namelist()}
    except UNREADABLE as error:
        raise InputError(f"{path}: not an .npz file ({one_line(error)})") from None
