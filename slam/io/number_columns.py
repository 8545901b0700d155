"""Text files with columns of numbers, and comments after `#`."""

from __future__ import annotations

import numpy as np

from slam.bounds import MAX_TIME, all_within
from slam.errors import InputError
from slam.geometry import Array
from slam.io.files import AnyPath, text_lines
from slam.io.guard import RECORD_BYTES, guarded, take
from slam.io.one_line import one_line


def read_columns(path: AnyPath, columns: str) -> tuple[Array, list[int]]:
    """Rows (n, k) of finite numbers, k names in `columns`, and each row's line number.

    Raises InputError that names file, line and what was expected.
    """
    with guarded(path):
        return _read(path, columns)


def _read(path: AnyPath, columns: str) -> tuple[Array, list[int]]:
    width = len(columns.split())
    rows: list[list[float]] = []
    numbers: list[int] = []
    for number, text in text_lines(path):
        try:
            row = [float(word) for word in text.split()]
        except ValueError:
            row = []
        if len(row) != width or not all_within(row, MAX_TIME):
            raise InputError(
                f"{path}:{number}: expected {width} numbers `{columns}`, none beyond "
                f"{MAX_TIME:g}, got {one_line(text, 60)!r}"
            )
        take(RECORD_BYTES)
        rows.append(row)
        numbers.append(number)
    return np.array(rows, dtype=np.float64).reshape(-1, width), numbers
