"""The best candidates of a search that lie apart, found by their rows and columns."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.kernel import kernel

OTHER_TURN = math.radians(20.0)  # rad: two poses farther apart are different places
NONE = -1  # instead of the number of a candidate


class KeptPlaces(NamedTuple):
    """Room for the best candidates, of which each is of another place.

    found   (most, 3) turns, rows and columns, these from the middle of the window; NONE: empty
    values  (most,) their sums; of empty room `least`
    first   (rows, columns) of the window: the number of a candidate that is kept there, or NONE
    other   (most,) that of another one there, or NONE
    turns   (turns,) rad
    radius  squared, of a place, in candidates
    least   a candidate must be better
    """

    found: np.ndarray
    values: np.ndarray
    first: np.ndarray
    other: np.ndarray
    turns: Array
    radius: float
    least: int


@kernel
def no_places(most, least, turns, radius, window):
    """Empty room for so many; `window`: columns and rows to both sides of the middle."""
    found, values = np.full((most, 3), NONE), np.full(most, least)
    first = np.full((2 * window[1] + 1, 2 * window[0] + 1), np.int32(NONE))
    return KeptPlaces(found, values, first, np.empty(most, np.int32), turns, radius, least)


@kernel
def keep(kept: KeptPlaces, turn, row, col, value, worst):
    """Keep a candidate, of a `value` above the worst one, instead of that, unless one as good is of
    the same place; worse ones of the same place are dropped. Returns the worst value that is kept
    then."""
    if not _drop_worse(kept, turn, row, col, value):
        return worst
    found, values, slot = kept.found, kept.values, 0
    lowest = values.min()
    while values[slot] > lowest:
        slot += 1
    if found[slot, 0] != NONE:
        _drop(kept, slot)
    found[slot, 0], found[slot, 1], found[slot, 2], values[slot] = turn, row, col, value
    i, j = _in_window(kept, row, col)
    kept.other[slot], kept.first[i, j] = kept.first[i, j], slot
    return values.min()


@kernel
def best_first(kept: KeptPlaces):
    """(n, 3) turns, rows and columns of what was kept, the best one first."""
    order = np.argsort(-kept.values, kind="mergesort")
    return kept.found[order[: (kept.values > kept.least).sum()]]


@kernel
def _drop_worse(kept: KeptPlaces, turn, row, col, value):
    """Drop the candidates of the same place if all of them are worse; returns whether they are."""
    first, reach = kept.first, int(math.sqrt(kept.radius))
    i, j = _in_window(kept, row, col)
    for dropping in (False, True):
        worse = False
        for r in range(max(i - reach, 0), min(i + reach + 1, first.shape[0])):
            for c in range(max(j - reach, 0), min(j + reach + 1, first.shape[1])):
                k = first[r, c]
                while k != NONE:
                    following = kept.other[k]
                    if _same_place(kept, k, turn, row, col):
                        if dropping:
                            _drop(kept, k)
                        elif kept.values[k] >= value:
                            return False
                        worse = True
                    k = following
        if not worse:
            break
    return True


@kernel
def _same_place(kept: KeptPlaces, k, turn, row, col):
    """Whether candidate k of those kept is of the same place as another one."""
    if (row - kept.found[k, 1]) ** 2 + (col - kept.found[k, 2]) ** 2 > kept.radius:
        return False
    apart = abs(kept.turns[turn] - kept.turns[kept.found[k, 0]])
    return min(apart, abs(2.0 * np.pi - apart)) <= OTHER_TURN


@kernel
def _drop(kept: KeptPlaces, k):
    """Make the room of candidate k empty."""
    first, other = kept.first, kept.other
    i, j = _in_window(kept, kept.found[k, 1], kept.found[k, 2])
    if first[i, j] == k:
        first[i, j] = other[k]
    else:
        before = first[i, j]
        while other[before] != k:
            before = other[before]
        other[before] = other[k]
    kept.found[k, 0], kept.values[k] = NONE, kept.least


@kernel
def _in_window(kept: KeptPlaces, row, col):
    """Row and column from the corner of the window."""
    return row + kept.first.shape[0] // 2, col + kept.first.shape[1] // 2
