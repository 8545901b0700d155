"""Gaps between static cells that changing cells fill from end to end: candidates for doors."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation, maximum_filter

from slam.geometry import Array
from slam.grid import GridSpec
from slam.kernel import kernel
from slam.layers.classification import FREE, STATIC, UNKNOWN

MIN_DOOR_WIDTH, MAX_DOOR_WIDTH = 0.55, 1.4  # m
MIN_CHANGING_SHARE = 0.5  # of the cells of a gap, ...
MIN_CHANGING_LENGTH = 0.45  # ... and m: walls flicker over less
JAMB_LENGTH = 0.12  # m from the gap's ends, where static cells may be the jamb
ANCHOR_DISTANCE = 2  # cells between changing cells and the end of a gap
BESIDE_WEIGHT = 0.5  # of a leaf's cell beside the gap's line, by that of one on it
FREE_PENALTY, STATIC_PENALTY = 0.2, 2.0  # s, of a cell of the gap that does not change


def find_gaps(kind: np.ndarray, leaf: np.ndarray, spec: GridSpec) -> list[Array]:
    """The gaps, each by its two ends (2, 2), m, map frame; best first, without overlaps.

    kind  (rows, cols) classes of the cells
    leaf  (rows, cols) s of evidence that a cell is part of a door's leaf: time occupied, of cells
          that were free as well
    """
    near = binary_dilation(leaf > 0, np.ones((3, 3)), iterations=ANCHOR_DISTANCE)
    value = np.maximum(leaf, BESIDE_WEIGHT * maximum_filter(leaf, 3))
    cells = 1 / spec.resolution
    limits = (
        MIN_DOOR_WIDTH * cells,
        MAX_DOOR_WIDTH * cells,
        JAMB_LENGTH * cells,
        MIN_CHANGING_LENGTH * cells,
    )
    gaps = _gaps(np.argwhere((kind == STATIC) & near), kind, value, limits)
    best = _without_overlaps(gaps[np.argsort(-gaps[:, 4], kind="stable"), :4])
    return [spec.centres(ends.astype(np.int64)) for ends in best.reshape(-1, 2, 2)]


@kernel
def _without_overlaps(gaps):
    """Non-maximum suppression: the gaps (n, 4) whose middle is farther from that of all kept before
    than the sum of both half lengths."""
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
    """(n, 5) rows and columns of both ends of each gap, the first an anchor, and its score, s."""
    found, n = np.empty((64, 5)), 0
    narrowest, widest, clear, shortest = limits
    reach = int(widest)
    for i in range(len(anchors)):
        row, col = anchors[i]
        for r in range(max(row - reach, 0), min(row + reach + 1, kind.shape[0])):
            for c in range(max(col - reach, 0), min(col + reach + 1, kind.shape[1])):
                if kind[r, c] == STATIC and narrowest <= np.hypot(r - row, c - col) <= widest:
                    total = _score(row, col, r, c, kind, value, clear, shortest)
                    if total > 0.0:
                        if n == len(found):
                            found = np.concatenate((found, np.empty_like(found)))
                        found[n, 0], found[n, 1], found[n, 2], found[n, 3] = row, col, r, c
                        found[n, 4] = total
                        n += 1
    return found[:n]


@kernel
def _score(row, col, to_row, to_col, kind, value, clear, shortest):
    """The score of a gap: the sum of the values between two cells, less penalties; 0 if a static
    cell lies between or too few cells change."""
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
            total -= FREE_PENALTY if kind[r, c] == FREE else STATIC_PENALTY
    enough = filled >= MIN_CHANGING_SHARE * (steps - 1) and filled * length / steps >= shortest
    return total if enough else 0.0
