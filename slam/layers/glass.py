"""Glass: what beams hit at a right angle, and pass through at any other.

A pane reflects a beam to the laser only within some degrees of the right angle (Foster, Sun, Park,
Kuipers 2013, VisAGGE: visible angle grid for glass environments, ICRA). So some angle of incidence
separates the beams that hit it from those that passed through; what moves is hit and passed at all
angles.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.grid import GridSpec
from slam.kernel import kernel
from slam.layers.regions import components, extents
from slam.layers.surface import SurfaceCells

BINS, BIN = 12, math.radians(2.5)  # of the angle of incidence; the last has all that are larger
MIN_HITS, MIN_PASSES = 3, 3  # of a cell of glass
MIN_WIDTH = 0.2  # m, of a pane
WIDEST = 6  # BINs within which glass is seen, at most: 15 degrees
MAX_STRAIGHT_PASSES = 0.25  # by the hits within the angle
MAX_SLANTED_HITS = 0.1  # by the passes beyond the angle


class Incidence(NamedTuple):
    """Observations of n cells by the angle of incidence, (n, BINS) each: uint16, scans with an echo
    in the cell or beside it (hits), and with a beam that passed through it (passes)."""

    hits: np.ndarray
    passes: np.ndarray

    @staticmethod
    def none(n: int) -> Incidence:
        """Of `n` cells, without an observation."""
        return Incidence(np.zeros((n, BINS), np.uint16), np.zeros((n, BINS), np.uint16))


@kernel
def meet(i, cos, occupied, incidence):
    """Add an observation of cell `i` at an angle of incidence with this cosine."""
    b = min(int(math.acos(min(cos, 1.0)) / BIN), BINS - 1)
    counts = incidence.hits if occupied else incidence.passes
    counts[i, b] = min(counts[i, b] + 1, 65535)


def panes(incidence: Incidence, surface: SurfaceCells, spec: GridSpec) -> np.ndarray:
    """(n,) bool: which of the surface cells are of glass. A pane is at least MIN_WIDTH wide: of
    people who walk by, single cells are hit at a right angle by chance."""
    found, seen_through = _separated(incidence)
    cells = np.zeros(spec.shape, np.bool_)
    cells[tuple(surface.cells[found].T)] = True
    labels, _ = components(cells)
    wide = extents(labels) * spec.resolution > MIN_WIDTH - spec.resolution / 2
    return found & seen_through & wide[labels[tuple(surface.cells.T)]]


@kernel
def _separated(incidence):
    """(n,) bool each: whether an angle of incidence separates the hits of a cell from the passes,
    and whether there are passes."""
    n = len(incidence.hits)
    result, seen_through = np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    for i in range(n):
        all_hits, all_passes = incidence.hits[i].sum(), incidence.passes[i].sum()
        seen_through[i] = all_passes >= MIN_PASSES
        hits = passes = 0
        for b in range(WIDEST):
            hits, passes = hits + incidence.hits[i, b], passes + incidence.passes[i, b]
            result[i] |= (
                hits >= MIN_HITS
                and passes <= MAX_STRAIGHT_PASSES * hits
                and all_hits - hits <= MAX_SLANTED_HITS * (all_passes - passes)
            )
    return result, seen_through
