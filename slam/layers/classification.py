"""Classification of cells by their observation statistics: free, static, changing or kept."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation, find_objects, label

from slam.layers.cell_statistics import FREE as FREE_STATE
from slam.layers.cell_statistics import CellStatistics
from slam.layers.surface import SurfaceCells

UNKNOWN, FREE, STATIC, CHANGING = 0, 1, 2, 3
KEPT = 4  # occupied by the SLAM's map, though seen once or by some beams only, and not seen to go
NO_REASON, SEEN_ONCE, SEEN_IN_PART, WENT_AWAY, DOOR_LEAF = range(5)  # kept, or left out
KEPT_REASONS = SEEN_ONCE, SEEN_IN_PART
MIN_HITS = 2  # scans with an echo in a static cell or beside it
STATIC_ECHOES_PER_PASS = 4  # above it a cell is static: passes are errors of the pose
STATIC_HITS_PER_PASS = 10  # above it a cell is static even if its state changed
MAX_FLICKER = 6  # cells: changing regions on a wall up to this height and width are its border
EIGHT_NEIGHBOURS = np.ones((3, 3), np.bool_)


def components(cells: np.ndarray) -> tuple[np.ndarray, int]:
    """Label the connected components (of 8 neighbours) of `cells` (rows, cols), from 1 on; returns
    the labels and the number of components."""
    labels = np.zeros(cells.shape, np.int32)
    count = label(cells, EIGHT_NEIGHBOURS, output=labels)
    return labels, int(count)  # pyright: ignore[reportArgumentType]


def classify(surface: SurfaceCells, statistics: CellStatistics, passed: np.ndarray) -> np.ndarray:
    """(rows, cols) uint8: UNKNOWN, FREE, STATIC or CHANGING.

    passed  (rows, cols) bool, cells that a beam crossed
    """
    kind = np.where(passed, FREE, UNKNOWN).astype(np.uint8)
    static = (statistics.state != FREE_STATE) & (statistics.hits >= MIN_HITS)
    static &= statistics.passes * STATIC_ECHOES_PER_PASS < surface.echoes
    static |= (statistics.flips > 0) & (statistics.passes * STATIC_HITS_PER_PASS < statistics.hits)
    found = np.where(static, STATIC, np.where(statistics.passes > 0, FREE, UNKNOWN))
    rows, cols = surface.cells.T
    changing = (statistics.flips > 0) & (
        statistics.passes * STATIC_HITS_PER_PASS >= statistics.hits
    )
    kind[rows, cols] = np.where(changing, CHANGING, found)
    return kind


def keep(kind: np.ndarray, believed: np.ndarray, went: np.ndarray, once: np.ndarray) -> np.ndarray:
    """Set cells to KEPT in `kind` that another map holds to be occupied and that were not seen to
    go, unless they are static; (rows, cols) each, as is what is returned, uint8: the reasons.

    once  whether at most one scan saw the cell
    """
    doubtful = believed & (kind != STATIC)
    kept = doubtful & ~went & (kind != CHANGING)
    kind[kept] = KEPT
    kept_for = np.where(once, SEEN_ONCE, SEEN_IN_PART)
    left_out_for = np.where(went, WENT_AWAY, DOOR_LEAF)
    return np.select([kept, doubtful], [kept_for, left_out_for], NO_REASON).astype(np.uint8)


def remove_flicker(kind: np.ndarray, number: np.ndarray, statistics: CellStatistics) -> None:
    """Reclassify small changing regions beside static cells by the state that they mostly had."""
    occupied = statistics.occupied_for >= statistics.free_for
    labels, count = components(kind == CHANGING)
    if not count:
        return
    beside: np.ndarray = np.asarray(binary_dilation(kind == STATIC, EIGHT_NEIGHBOURS), np.bool_)
    on_wall: np.ndarray = np.bincount(labels[beside], minlength=count + 1) > 0
    small = [
        max(part.stop - part.start for part in box) <= MAX_FLICKER
        for box in find_objects(labels)
        if box
    ]
    few = np.flatnonzero(np.array([False, *small]) & on_wall)
    rows, cols = np.nonzero(np.isin(labels, few))
    kind[rows, cols] = np.where(occupied[number[rows, cols]], STATIC, FREE)
