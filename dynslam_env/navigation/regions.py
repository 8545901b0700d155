"""Regions of a raster: clusters of cells, and the cells around some."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from slam.kernel import kernel

Bools = NDArray[np.bool_]
Cells = NDArray[np.int64]
Window = tuple[slice, slice]

FOUR_NEIGHBOURS = np.array([(0, 1, 0), (1, 1, 1), (0, 1, 0)], dtype=np.bool_)
EIGHT_NEIGHBOURS = np.ones((3, 3), dtype=np.bool_)


def clusters(cells: Bools, min_cells: int = 1) -> list[Cells]:
    """The 8-connected sets of cells: (n, 2) rows and columns each.

    cells      (rows, cols)
    min_cells  of a set; smaller ones are left out
    """
    return _parts(cells, cells, min_cells)


def loose_clusters(cells: Bools, min_cells: int = 1) -> list[Cells]:
    """The same, with gaps of up to two cells allowed within a cluster."""
    return _parts(cells, dilated(cells, EIGHT_NEIGHBOURS), min_cells) if cells.any() else []


def dilated(cells: Bools, shape: Bools) -> Bools:
    """(rows, cols) `cells` and their neighbours, FOUR_NEIGHBOURS or EIGHT_NEIGHBOURS."""
    return around(cells, np.argwhere(shape) - 1)


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


def near_to(cells: Bools, resolution: float, distance: float) -> Bools:
    """(rows, cols) whether the centre of one of `cells` is within `distance`, m."""
    if not cells.any():
        return np.zeros_like(cells)
    return around(cells, _offsets_within(resolution, distance))


def _offsets_within(resolution: float, distance: float) -> Cells:
    """(n, 2) rows and columns from a cell to those whose centres are within `distance`, m."""
    reach = math.ceil(distance / resolution)
    offsets = np.argwhere(np.ones((2 * reach + 1, 2 * reach + 1))) - reach
    return offsets[np.sqrt(np.square(offsets * resolution).sum(axis=1)) <= distance]


def around(cells: Bools, offsets: Cells) -> Bools:
    """(rows, cols) whether one of `cells` lies at one of `offsets` (n, 2), rows and columns, which
    are symmetric."""
    return _stamped(cells, offsets, np.zeros_like(cells))


@kernel
def _stamped(cells, offsets, found):
    rows, cols = found.shape
    for r in range(rows):
        for c in range(cols):
            if cells[r, c]:
                for n in range(len(offsets)):
                    row, col = r + offsets[n, 0], c + offsets[n, 1]
                    if 0 <= row < rows and 0 <= col < cols:
                        found[row, col] = True
    return found


def _parts(cells: Bools, joined: Bools, min_cells: int) -> list[Cells]:
    """Those of `cells` in each 8-connected set of `joined`."""
    found, ends = _grouped(cells, joined)
    least = max(min_cells, 1)
    sides = pairwise([0, *ends.tolist()])
    return [found.T[start:end] for start, end in sides if end - start >= least]


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
