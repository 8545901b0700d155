"""Gaps in what always stands, that what changes fills from end to end."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation, maximum_filter

from slam.geometry import Array
from slam.grid import GridSpec
from slam.kernel import kernel
from slam.layers.kinds import FREE, STATIC, UNKNOWN

NARROWEST, WIDEST = 0.55, 1.4  # m, of a door
FILLED = 0.5  # share of a gap that must be seen to change, ...
SHORTEST = 0.45  # ... and m: walls flicker over less
CLEAR = 0.12  # m from the gap's ends, where what stands may still be the jamb
ANCHOR = 2  # cells, from what changes to the end of a gap
BESIDE = 0.5  # what a leaf's cell beside the gap's line is worth, of one on it
OPEN, SHUT = 0.2, 2.0  # s that a cell of the gap which is always free, or never, speaks against it


def find_gaps(kind: np.ndarray, leaf: np.ndarray, spec: GridSpec) -> list[Array]:
    """The gaps, each as its two ends (2, 2), m, map frame; the best first, and none near another.

    kind  (rows, cols) kinds of cells
    leaf  (rows, cols) s for which a cell looks like a leaf's: it was occupied, and free as well
    """
    near = binary_dilation(leaf > 0, np.ones((3, 3)), iterations=ANCHOR)
    value = np.maximum(leaf, BESIDE * maximum_filter(leaf, 3))
    cells = 1 / spec.resolution
    limits = NARROWEST * cells, WIDEST * cells, CLEAR * cells, SHORTEST * cells
    gaps = _gaps(np.argwhere((kind == STATIC) & near), kind, value, limits)
    best = _apart(gaps[np.argsort(-gaps[:, 4], kind="stable"), :4])
    return [spec.centres(ends.astype(np.int64)) for ends in best.reshape(-1, 2, 2)]


@kernel
def _apart(gaps):
    """The first of gaps (n, 4), and of the others those whose middle lies farther from that of any
    before than the halves of both are long."""
    kept, n = np.empty_like(gaps), 0
    for row, col, to_row, to_col in gaps:
        length, near = np.hypot(to_row - row, to_col - col), False
        for k in range(n):
            dr = (kept[k, 0] + kept[k, 2] - row - to_row) / 2
            dc = (kept[k, 1] + kept[k, 3] - col - to_col) / 2
            other = np.hypot(kept[k, 2] - kept[k, 0], kept[k, 3] - kept[k, 1])
            near = near or np.hypot(dr, dc) <= (length + other) / 2
        if not near:
            kept[n, 0], kept[n, 1], kept[n, 2], kept[n, 3] = row, col, to_row, to_col
            n += 1
    return kept[:n]


@kernel
def _gaps(anchors, kind, value, limits):
    """(n, 5) rows and columns of both ends of each gap, the first an anchor, and how well it is
    filled, s."""
    found, n = np.empty((64, 5)), 0
    narrowest, widest, clear, shortest = limits
    reach = int(widest)
    for i in range(len(anchors)):
        row, col = anchors[i]
        for r in range(max(row - reach, 0), min(row + reach + 1, kind.shape[0])):
            for c in range(max(col - reach, 0), min(col + reach + 1, kind.shape[1])):
                if kind[r, c] == STATIC and narrowest <= np.hypot(r - row, c - col) <= widest:
                    total = _filled(row, col, r, c, kind, value, clear, shortest)
                    if total > 0.0:
                        if n == len(found):
                            found = np.concatenate((found, np.empty_like(found)))
                        found[n, 0], found[n, 1], found[n, 2], found[n, 3] = row, col, r, c
                        found[n, 4] = total
                        n += 1
    return found[:n]


@kernel
def _filled(row, col, to_row, to_col, kind, value, clear, shortest):
    """The sum of the values between two cells, less what speaks against a gap; 0 where something
    always stands between or too little changes."""
    length = np.hypot(to_row - row, to_col - col)
    steps = int(np.ceil(length))
    filled, total = 0, 0.0
    for k in range(1, steps):
        r = int(np.round(row + (to_row - row) * k / steps))
        c = int(np.round(col + (to_col - col) * k / steps))
        stands = kind[r, c] == STATIC or kind[r, c] == UNKNOWN
        if stands and min(k, steps - k) > clear:
            return 0.0
        filled += value[r, c] > 0.0
        if value[r, c] > 0.0:
            total += value[r, c]
        else:
            total -= OPEN if kind[r, c] == FREE else SHUT
    enough = filled >= FILLED * (steps - 1) and filled * length / steps >= shortest
    return total if enough else 0.0
