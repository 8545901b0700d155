"""A large map for a small picture: walls thinner than a pixel stay."""

from __future__ import annotations

import math

import numpy as np

from slam.grid import TILE, GridSpec, OccupancyGrid


def coarser(grid: OccupancyGrid, pixel: float) -> OccupancyGrid:
    """The map in cells that a power of two of its own make, about as large as a pixel, m.

    Each is as occupied as the most occupied cell in it that was observed. The map itself where its
    cells are larger than half a pixel.
    """
    fold = 2 ** min(
        math.floor(math.log2(max(pixel / grid.spec.resolution, 1.0))), TILE.bit_length() - 1
    )
    if fold == 1:
        return grid
    rows, cols = grid.spec.rows // fold, grid.spec.cols // fold
    blocks = rows, fold, cols, fold
    seen = np.where(grid.observed, grid.occupied, 0.0).reshape(blocks).max(axis=(1, 3))
    observed = np.asarray(grid.observed.reshape(blocks).any(axis=(1, 3)))
    spec = GridSpec(grid.spec.resolution * fold, grid.spec.row0 // fold, grid.spec.col0 // fold,
                    rows, cols)  # fmt: skip
    return OccupancyGrid(spec, np.where(observed, seen, 0.5), observed)
