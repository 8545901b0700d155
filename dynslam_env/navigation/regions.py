"""Regions of a raster: clusters of cells, and the cells around some."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from slam.kernel import kernel

Bools = NDArray[np.bool_]
Cells = NDArray[np.int64]
Window = tuple[slice, slice]

FOUR_NEIGHBOURS = np.array([0, 1, 0])
EIGHT_NEIGHBOURS = np.array([1, 1, 1])
"""Shapes around a cell: (2 k + 1,) columns to each side, in the rows from k before to k after."""


def loose_clusters(cells: Bools, min_cells: int = 1) -> list[Cells]:
    """Sets of cells, 8-connected but for gaps of up to two cells: (n, 2) rows and columns each.

    cells      (rows, cols)
    min_cells  of a set; smaller ones are left out
    """
    if not cells.any():
        return []
    found, ends = _grouped(cells, dilated(cells, EIGHT_NEIGHBOURS))
    least = max(min_cells, 1)
    sides = pairwise([0, *ends.tolist()])
    return [found.T[start:end] for start, end in sides if end - start >= least]


def grouped(cells: Bools) -> tuple[Cells, Cells]:
    """The cells of all 8-connected sets: (2, n) rows and columns, set by set, and (sets,) the end
    of each set. Sets and cells are in the order of their rows, then columns."""
    return _grouped(cells, cells)


def dilated(cells: Bools, shape: Cells) -> Bools:
    """(rows, cols) `cells` and those around them, in a shape such as FOUR_NEIGHBOURS, or `disc`."""
    return _dilated(cells, shape) if cells.any() else np.zeros_like(cells)


@cache
def disc(resolution: float, distance: float, border: float = 0.0) -> Cells:
    """The shape of the cells whose centres are within `distance`, m, less `border` m."""
    reach = math.ceil((distance + border) / resolution)
    sides = np.square(np.arange(-reach, reach + 1) * resolution)
    within = np.sqrt(sides[:, None] + sides) - border <= distance
    return np.maximum((within.sum(axis=1) - 1) // 2, -1)


@kernel
def _dilated(cells, shape):
    rows, cols = cells.shape
    found, reach = np.zeros((rows, cols), np.bool_), len(shape) // 2
    for row in range(rows):
        col = 0
        while col < cols:
            if not cells[row, col]:
                col += 1
                continue
            first = col
            while col < cols and cells[row, col]:
                col += 1
            for k in range(len(shape)):
                r, side = row + k - reach, shape[k]
                if 0 <= r < rows and side >= 0:
                    for c in range(max(first - side, 0), min(col + side, cols)):
                        found[r, c] = True
    return found


def extent(cells: Bools, margin: int = 0) -> Window:
    """The rows and columns that hold all `cells`, and `margin` more on each side; empty without a
    cell."""
    top, bottom, left, right = _extent(cells)
    return slice(max(top - margin, 0), bottom + margin), slice(
        max(left - margin, 0), right + margin
    )


@kernel
def _extent(cells):
    """The first row of `cells`, the one after the last; the columns likewise; zeros without any."""
    (rows, cols), bottom, right = cells.shape, 0, 0
    top, left = rows, cols
    for row in range(rows):
        for col in range(cols):
            if cells[row, col]:
                top, bottom = min(top, row), row + 1
                left, right = min(left, col), max(right, col + 1)
    return min(top, bottom), bottom, min(left, right), right


@kernel
def _grouped(cells, joined):
    """(2, n) rows and columns of `cells`, by the 8-connected sets of `joined` that hold them, and
    (sets,) the end of each set. Sets and cells are in the order of their rows, then columns."""
    rows, cols = cells.shape
    labels, stack = np.zeros((rows, cols), np.int32), np.empty(rows * cols, np.int32)
    sizes, count = np.zeros(64, np.int64), 0
    for row in range(rows):
        for col in range(cols):
            if not joined[row, col] or labels[row, col]:
                continue
            if count == len(sizes):
                sizes = np.append(sizes, np.zeros_like(sizes))
            count += 1
            labels[row, col], stack[0], left = count, row * cols + col, 1
            while left:
                left -= 1
                r, c = stack[left] // cols, stack[left] % cols
                sizes[count - 1] += cells[r, c]
                for i in range(max(r - 1, 0), min(r + 2, rows)):
                    for j in range(max(c - 1, 0), min(c + 2, cols)):
                        if joined[i, j] and not labels[i, j]:
                            labels[i, j], stack[left] = count, i * cols + j
                            left += 1
    ends = np.cumsum(sizes[:count])
    free = ends - sizes[:count]
    found = np.empty((2, ends[-1] if count else 0), np.int64)
    for row in range(rows):
        for col in range(cols):
            if labels[row, col] and cells[row, col]:
                k = labels[row, col] - 1
                found[0, free[k]], found[1, free[k]] = row, col
                free[k] += 1
    return found, ends
