"""The outline of a union of rectangles, with as few segments as possible."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.kernel import kernel


class Rect(NamedTuple):
    """An axis-aligned rectangle, m."""

    left: float
    bottom: float
    right: float
    top: float


def outline(rects: Sequence[Rect]) -> Array:
    """(n, 4) segments x1, y1, x2, y2, m, of the boundary of the union of `rects`.

    The edges of all rectangles divide the plane into cells that are entirely free or solid. Runs of
    edges between free and solid cells are joined.
    """
    return _outline(np.array(rects, dtype=np.float64))


@kernel
def _outline(rects):
    """See `outline`; `rects` (r, 4)."""
    xs, ys = np.unique(rects[:, ::2].copy().ravel()), np.unique(rects[:, 1::2].copy().ravel())
    free = np.zeros((len(xs) + 1, len(ys) + 1), dtype=np.int8)  # with a border of solid cells
    for left, bottom, right, top in rects:
        first, last = np.searchsorted(xs, left), np.searchsorted(xs, right)
        low, high = np.searchsorted(ys, bottom), np.searchsorted(ys, top)
        free[first + 1 : last + 1, low + 1 : high + 1] = 1
    edges = np.empty((2 * len(xs) * len(ys), 4))
    count = 0
    for i in range(len(xs)):
        begun, before = 0, 0
        for j in range(len(ys)):  # the last row is the border
            step = free[i + 1, j + 1] - free[i, j + 1]
            if step != before:
                if before != 0:
                    edges[count] = xs[i], ys[begun], xs[i], ys[j]
                    count += 1
                begun, before = j, step
    for j in range(len(ys)):
        begun, before = 0, 0
        for i in range(len(xs)):
            step = free[i + 1, j + 1] - free[i + 1, j]
            if step != before:
                if before != 0:
                    edges[count] = xs[begun], ys[j], xs[i], ys[j]
                    count += 1
                begun, before = i, step
    return edges[:count].copy()
