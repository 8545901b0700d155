"""Classification of cells by their observation statistics: free, static, changing or kept."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation

from slam.layers.cell_statistics import FREE as FREE_STATE
from slam.layers.cell_statistics import CellStatistics
from slam.layers.regions import EIGHT_NEIGHBOURS, components, extents
from slam.layers.surface import SurfaceCells

UNKNOWN, FREE, STATIC, CHANGING = 0, 1, 2, 3
KEPT = 4  # not seen to go, though seen once, or by some beams only
NO_REASON, SEEN_ONCE, SEEN_IN_PART, WENT_AWAY, DOOR_LEAF, GLASS = range(6)  # kept, or left out
KEPT_REASONS = SEEN_ONCE, SEEN_IN_PART, GLASS
MIN_HITS = 2  # scans with an echo in a static cell or beside it
STATIC_ECHOES_PER_PASS = 4  # above it a cell is static: passes are errors of the pose
STATIC_HITS_PER_PASS = 10  # above it a cell is static even if its state changed
MAX_FLICKER = 6  # cells: changing regions on a wall up to this height and width are its border


def classify(
    surface: SurfaceCells, statistics: CellStatistics, passed: np.ndarray, glass: np.ndarray
) -> np.ndarray:
    """(rows, cols) uint8: UNKNOWN, FREE, STATIC, CHANGING, or KEPT, which glass is.

    passed  (rows, cols) bool, cells that a beam crossed
    glass   (n,) bool, surface cells of glass
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
    found = np.where(changing, CHANGING, found)
    kind[rows, cols] = np.where(glass & (found != STATIC), KEPT, found)
    return kind


def keep(
    kind: np.ndarray, glass: np.ndarray, believed: np.ndarray, went: np.ndarray, once: np.ndarray
) -> np.ndarray:
    """Set cells to KEPT in `kind` that are of glass, or that another map holds to be occupied and
    that were not seen to go, unless they are static; (rows, cols) each, as is what is returned,
    uint8: the reasons. What changes is left out for a reason, too, whatever the other map says: it
    stood there for some time.

    once  whether at most one scan saw the cell
    """
    doubtful = (believed | glass) & (kind != STATIC)
    kept = doubtful & ~went & (kind != CHANGING)
    kind[kept] = KEPT
    kept_for = np.where(glass, GLASS, np.where(once, SEEN_ONCE, SEEN_IN_PART))
    left_out_for = np.where(went, WENT_AWAY, DOOR_LEAF)
    left_out = doubtful | (kind == CHANGING)
    return np.select([kept, left_out], [kept_for, left_out_for], NO_REASON).astype(np.uint8)


def remove_flicker(kind: np.ndarray, number: np.ndarray, statistics: CellStatistics) -> None:
    """Reclassify small changing regions beside static cells by the state that they mostly had."""
    occupied = statistics.occupied_for >= statistics.free_for
    labels, count = components(kind == CHANGING)
    if not count:
        return
    beside: np.ndarray = np.asarray(binary_dilation(kind == STATIC, EIGHT_NEIGHBOURS), np.bool_)
    on_wall: np.ndarray = np.bincount(labels[beside], minlength=count + 1) > 0
    few = np.flatnonzero((extents(labels) <= MAX_FLICKER) & on_wall)
    few = few[few > 0]
    rows, cols = np.nonzero(np.isin(labels, few))
    kind[rows, cols] = np.where(occupied[number[rows, cols]], STATIC, FREE)
