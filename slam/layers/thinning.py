"""Thinning: the skeleton of an area, one cell wide and connected as the area is.

Zhang and Suen (1984), applied only to the cells that are left in each pass.
"""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel


def skeleton(area: np.ndarray) -> np.ndarray:
    """(rows, cols) bool: the skeleton of `area` (rows, cols) bool. Cells outside the array do not
    belong to the area."""
    padded = np.pad(np.asarray(area, np.bool_), 1)
    _thin(padded, np.argwhere(padded))
    return padded[1:-1, 1:-1].copy()


@kernel
def _thin(area, cells):
    """Remove cells (n, 2) of the border from `area` in turns from two sides, until none goes."""
    around = np.zeros(9, np.int64)  # neighbours clockwise from above, the first repeated at the end
    marked = np.empty(len(cells), np.int64)
    n, changed = len(cells), True
    while changed:
        changed = False
        for side in range(2):
            found = 0
            for k in range(n):
                r, c = cells[k]
                if _removable(area, r, c, side, around):
                    marked[found] = k
                    found += 1
            for k in range(found):
                area[cells[marked[k], 0], cells[marked[k], 1]] = False
            changed = changed or found > 0
            left = 0
            for k in range(n):
                r, c = cells[k]
                if area[r, c]:
                    cells[left, 0], cells[left, 1] = r, c
                    left += 1
            n = left


@kernel
def _removable(area, r, c, side, around):
    """Whether a cell of the border can go from one of the two sides without cutting the area."""
    if area[r - 1, c] and area[r, c + 1] and area[r + 1, c] and area[r, c - 1]:
        return False  # within the area, as most cells are
    around[0], around[1], around[2] = area[r - 1, c], area[r - 1, c + 1], area[r, c + 1]
    around[3], around[4], around[5] = area[r + 1, c + 1], area[r + 1, c], area[r + 1, c - 1]
    around[6], around[7], around[8] = area[r, c - 1], area[r - 1, c - 1], area[r - 1, c]
    neighbours, borders = 0, 0
    for k in range(8):
        neighbours += around[k]
        borders += around[k] == 0 and around[k + 1] == 1
    if borders != 1 or not 2 <= neighbours <= 6:
        return False
    up, right, down, left = around[0], around[2], around[4], around[6]
    if side == 0:
        return up * right * down == 0 and right * down * left == 0
    return up * right * left == 0 and up * down * left == 0
