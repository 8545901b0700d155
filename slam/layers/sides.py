"""Whether what stood in a cell went away, by what each side saw of it in the order of time.

A thing that is thin, porous or of glass is hit by some beams and passed by others: which ones, is a
matter of the direction, or of chance. What goes away is hit from one side, and then passed from the
same side, many times each in a row.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.kernel import kernel

SIDES = 16  # from which a cell is seen: directions of 22.5 degrees each
MOST = 65535  # observations of a side that are counted
MIN_PASSES, MIN_PASSES_IN_ROW = 5, 5  # from sides that had hit the cell, if something went away
MAX_CHANGES = 0.5  # changes from hit to pass and back, by the number that chance alone would make
SELDOM_PASSES, SELDOM_IN_ROW = 8, 6  # the same, ...
SELDOM_HIT = 4.0  # ... where passes are so many times as many as hits: someone walked by


class Sides(NamedTuple):
    """Observations of each of n cells from each of SIDES directions, (n, SIDES) each.

    hits     uint16, scans with an echo in the cell or beside it
    passes   uint16, scans with a beam that passed through
    changes  uint16, from a hit to a pass or back
    row      uint16, passes in a row until now; longest: the most in a row
    last     uint8, 1 if it was a hit, 2 if a pass, 0 if there was none
    """

    hits: np.ndarray
    passes: np.ndarray
    changes: np.ndarray
    row: np.ndarray
    longest: np.ndarray
    last: np.ndarray

    @staticmethod
    def none(n: int) -> Sides:
        """Of `n` cells, without an observation."""
        counts = (np.zeros((n, SIDES), np.uint16) for _ in range(5))
        hits, passes, changes, row, longest = counts
        return Sides(hits, passes, changes, row, longest, np.zeros((n, SIDES), np.uint8))


@kernel
def see(i, dx, dy, occupied, sides):
    """Add an observation of cell `i`, that lies (dx, dy) from the sensor."""
    s = int((math.atan2(dy, dx) + math.pi) / (2.0 * math.pi) * SIDES) % SIDES
    now = 1 if occupied else 2
    if sides.last[i, s] != 0 and sides.last[i, s] != now:
        sides.changes[i, s] = min(sides.changes[i, s] + 1, MOST)
    sides.last[i, s] = now
    if occupied:
        sides.hits[i, s] = min(sides.hits[i, s] + 1, MOST)
        sides.row[i, s] = 0
    else:
        sides.passes[i, s] = min(sides.passes[i, s] + 1, MOST)
        sides.row[i, s] = min(sides.row[i, s] + 1, MOST)
        sides.longest[i, s] = max(sides.longest[i, s], sides.row[i, s])


@kernel
def went_away(sides):
    """(n,) bool: whether what stood in a cell was seen to go, or to come."""
    result = np.zeros(len(sides.hits), np.bool_)
    for i in range(len(result)):
        hits = passes = changes = longest = 0
        by_chance = 0.0
        for s in range(SIDES):
            h, p = float(sides.hits[i, s]), float(sides.passes[i, s])
            if h > 0 and p > 0:
                hits, passes, changes = hits + h, passes + p, changes + sides.changes[i, s]
                longest = max(longest, sides.longest[i, s])
                by_chance += 2.0 * h * p / (h + p)
        steady = changes <= MAX_CHANGES * by_chance
        often = passes >= MIN_PASSES and longest >= MIN_PASSES_IN_ROW
        seldom = passes >= SELDOM_PASSES and longest >= SELDOM_IN_ROW
        result[i] = (often and steady) or (seldom and passes >= SELDOM_HIT * hits)
    return result
