"""The distance to the nearest of some cells, for every cell of a raster.

The transform of Maurer, Qi and Raghavan (2003), as scipy's `distance_transform_edt` does it: equal
to the last digit, in half its time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.geometry import Array
from slam.kernel import kernel

NONE = -1  # row of no cell


def distances(cells: NDArray[np.bool_], resolution: float) -> Array:
    """(rows, cols) m between the centres of a cell and of the nearest of `cells`; inf without
    any."""
    return _distances(cells, resolution, _nearest_rows(cells))


@kernel
def _nearest_rows(cells):
    """(rows, cols) row of the nearest of `cells` in the same column, the upper one of two."""
    rows, cols = cells.shape
    found = np.empty((rows, cols), np.int32)
    for col in range(cols):
        last = NONE
        for row in range(rows):
            if cells[row, col]:
                last = row
            found[row, col] = last
        last = NONE
        for row in range(rows - 1, -1, -1):
            if cells[row, col]:
                last = row
            above = found[row, col]
            if last != NONE and (above == NONE or last - row < row - above):
                found[row, col] = last
    return found


@kernel
def _distances(cells, resolution, near):
    """Of each row, the columns whose nearest cells in `near` are the nearest of all to some part of
    the row, and from these the distance of each of its cells."""
    rows, cols = cells.shape
    away = np.full((rows, cols), np.inf)
    kept, squares = np.empty(cols, np.int64), np.empty(cols)
    for row in range(rows):
        rows_here, last = near[row], -1
        for col in range(cols):
            if rows_here[col] == NONE:
                continue
            squares[col] = ((rows_here[col] - row) * resolution) ** 2
            while last >= 1:
                here, before = kept[last], kept[last - 1]
                a, b = (here - before) * resolution, (col - here) * resolution
                c = a + b
                if c * squares[here] - b * squares[before] - a * squares[col] - a * b * c <= 0.0:
                    break
                last -= 1
            last += 1
            kept[last] = col
        if last < 0:
            continue
        k, here = 0, kept[0]
        for col in range(cols):
            least = squares[here] + ((here - col) * resolution) ** 2
            while k < last:
                following = kept[k + 1]
                after = squares[following] + ((following - col) * resolution) ** 2
                if least <= after:
                    break
                least, here = after, following
                k += 1
            away[row, col] = np.sqrt(least)
    return away
