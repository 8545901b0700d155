"""The layers of a map as one number a cell: the more important to see, the higher."""

from __future__ import annotations

import numpy as np

from slam.io.layers import COLOURS
from slam.layers import Layers
from slam.layers.classification import CHANGING, FREE, KEPT, STATIC

CHANGING_SHADES = 6  # from seldom to mostly occupied
NEVER_SEEN, FREE_CELL, SELDOM = 0, 1, 2
MOSTLY = SELDOM + CHANGING_SHADES - 1
KEPT_CELL, STANDS = MOSTLY + 1, MOSTLY + 2
NAMES = {
    STANDS: "always occupied",
    KEPT_CELL: "kept: seen once or in part, or glass",
    MOSTLY: "changes, mostly occupied",
    SELDOM: "changes, seldom occupied",
    FREE_CELL: "free",
    NEVER_SEEN: "never seen",
}


def ranked(layers: Layers) -> np.ndarray:
    """(rows, cols) uint8: NEVER_SEEN to STANDS."""
    cells = np.zeros(layers.spec.shape, np.uint8)
    for kind, number in ((FREE, FREE_CELL), (KEPT, KEPT_CELL), (STATIC, STANDS)):
        cells[layers.kind == kind] = number
    changing = layers.kind == CHANGING
    share = np.nan_to_num(layers.occupied[changing], nan=1.0)
    cells[changing] = SELDOM + np.rint((CHANGING_SHADES - 1) * share).astype(np.uint8)
    return cells


def palette() -> np.ndarray:
    """(STANDS + 1, 3) uint8: the colours of the numbers of `ranked`."""
    mixtures = np.linspace(COLOURS["seldom"], COLOURS["mostly"], CHANGING_SHADES)
    rows = [COLOURS["unknown"], COLOURS["free"], *mixtures, COLOURS["kept"], COLOURS["static"]]
    return np.rint(rows).astype(np.uint8)
