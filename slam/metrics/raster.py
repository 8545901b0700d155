"""Rasterised line segments: a cell is occupied if a segment touches it."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec
from slam.kernel import kernel

TOUCH = 1e-6  # cells: a wall on the border between two cells touches both


def rasterise(segments: Array, spec: GridSpec) -> np.ndarray:
    """(rows, cols) bool: the cells that segments (w, 4), m, touch; a border touches both cells."""
    return times_touched(np.asarray(segments)[None], spec) > 0


def times_touched(segments: Array, spec: GridSpec) -> np.ndarray:
    """(rows, cols) int: number of moments at which segments (n, w, 4), m, touch the cell."""
    last = np.full(spec.shape, -1, dtype=np.int32)
    count = np.zeros(spec.shape, dtype=np.int32)
    _count(np.ascontiguousarray(segments), spec.resolution, spec.row0, spec.col0, last, count)
    return count


@kernel
def _count(segments, resolution, row0, col0, last, count):
    """Add to `count` the moments at which a cell is touched; `last` is the last one counted."""
    for moment in range(segments.shape[0]):
        for k in range(segments.shape[1]):
            x1 = segments[moment, k, 0] / resolution - col0
            y1 = segments[moment, k, 1] / resolution - row0
            x2 = segments[moment, k, 2] / resolution - col0
            y2 = segments[moment, k, 3] / resolution - row0
            _touch(x1, y1, x2, y2, moment, last, count)


@kernel
def _touch(x1, y1, x2, y2, moment, last, count):
    """Count the cells of one segment: within each row it covers a range of columns."""
    rows, cols = count.shape
    first_row = max(int(np.floor(min(y1, y2) - TOUCH)), 0)
    last_row = min(int(np.floor(max(y1, y2) + TOUCH)), rows - 1)
    for row in range(first_row, last_row + 1):
        a, b = _within(y1, y2, row - TOUCH, row + 1 + TOUCH)
        if a > b:
            continue
        xa, xb = x1 + a * (x2 - x1), x1 + b * (x2 - x1)
        first_col = max(int(np.floor(min(xa, xb) - TOUCH)), 0)
        last_col = min(int(np.floor(max(xa, xb) + TOUCH)), cols - 1)
        for col in range(first_col, last_col + 1):
            if last[row, col] != moment:
                last[row, col] = moment
                count[row, col] += 1


@kernel
def _within(v1, v2, low, high):
    """The part [a, b] of [0, 1] in which v1 + t (v2 - v1) lies within [low, high]; a > b: none."""
    d = v2 - v1
    if d == 0.0:
        return (0.0, 1.0) if low <= v1 <= high else (1.0, 0.0)
    t1, t2 = (low - v1) / d, (high - v1) / d
    return max(min(t1, t2), 0.0), min(max(t1, t2), 1.0)
