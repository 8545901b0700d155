"""Kinds of cells: what the looks make of each."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation, find_objects, label

from slam.layers.looks import FREE as LOOKED_FREE
from slam.layers.looks import Looks
from slam.layers.surface import SurfaceCells

UNKNOWN, FREE, STATIC, CHANGING = 0, 1, 2, 3
FEWEST = 2  # scans with an echo in a cell or beside: one alone may be anything
RARE = 4  # times as many scans with an echo as went through: a wall on which poses err
SELDOM = 10  # times as many scans that saw it occupied as went through: no change either
FLICKER = 6  # cells: what changes on a wall over no more than that, each way, is its border
EIGHT = np.ones((3, 3), np.bool_)


def pieces(cells: np.ndarray) -> tuple[np.ndarray, int]:
    """Cells (rows, cols) numbered by the piece they hang together in, from 1, and how many there
    are."""
    labels = np.zeros(cells.shape, np.int32)
    count = label(cells, EIGHT, output=labels)
    return labels, int(count)  # pyright: ignore[reportArgumentType]


def kinds(surface: SurfaceCells, looks: Looks, passed: np.ndarray) -> np.ndarray:
    """(rows, cols) uint8: UNKNOWN, FREE, STATIC or CHANGING.

    passed  (rows, cols) bool, where a beam went
    """
    kind = np.where(passed, FREE, UNKNOWN).astype(np.uint8)
    stands = (looks.state != LOOKED_FREE) & (looks.hits >= FEWEST)
    stands &= looks.passes * RARE < surface.echoes
    stands |= (looks.flips > 0) & (looks.passes * SELDOM < looks.hits)
    found = np.where(stands, STATIC, np.where(looks.passes > 0, FREE, UNKNOWN))
    rows, cols = surface.cells.T
    changes = (looks.flips > 0) & (looks.passes * SELDOM >= looks.hits)
    kind[rows, cols] = np.where(changes, CHANGING, found)
    return kind


def settle(kind: np.ndarray, number: np.ndarray, looks: Looks) -> None:
    """A few changing cells beside what stands become what they mostly were."""
    occupied = looks.occupied_for >= looks.free_for
    labels, count = pieces(kind == CHANGING)
    if not count:
        return
    beside: np.ndarray = np.asarray(binary_dilation(kind == STATIC, EIGHT), np.bool_)
    on_wall: np.ndarray = np.bincount(labels[beside], minlength=count + 1) > 0
    small = [
        max(part.stop - part.start for part in box) <= FLICKER
        for box in find_objects(labels)
        if box
    ]
    few = np.flatnonzero(np.array([False, *small]) & on_wall)
    rows, cols = np.nonzero(np.isin(labels, few))
    kind[rows, cols] = np.where(occupied[number[rows, cols]], STATIC, FREE)
