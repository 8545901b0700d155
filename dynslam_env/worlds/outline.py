"""The outline of a union of rectangles, with as few segments as possible."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array


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
    edges = np.array(rects)
    xs, columns = np.unique(edges[:, 0::2], return_inverse=True)
    ys, rows = np.unique(edges[:, 1::2], return_inverse=True)
    free = np.zeros((len(xs) + 1, len(ys) + 1), dtype=np.int8)  # with a border of solid cells
    spans = np.hstack([columns.reshape(-1, 2), rows.reshape(-1, 2)]).tolist()
    for left, right, bottom, top in spans:
        free[left + 1 : right + 1, bottom + 1 : top + 1] = 1
    x, y1, y2 = _runs(np.diff(free, axis=0)[:, 1:-1])
    y, x1, x2 = _runs(np.diff(free, axis=1).T[:, 1:-1])
    upright = np.column_stack([xs[x], ys[y1], xs[x], ys[y2]])
    level = np.column_stack([xs[x1], ys[y], xs[x2], ys[y]])
    return np.vstack([upright, level])


def _runs(steps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Runs of one kind of step in each row of `steps` (-1, 0, 1): row, first, one past the last."""
    padded = np.pad(steps, ((0, 0), (1, 1)))
    before, after = padded[:, :-1], padded[:, 1:]
    change = before != after
    row, first = np.nonzero(change & (after != 0))
    _, end = np.nonzero(change & (before != 0))
    return row, first, end
