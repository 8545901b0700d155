"""Centroids of the echoes within their cells: walls do not stand at the centres of cells."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array
from slam.grid import TILE
from slam.kernel import kernel
from slam.maps.tiles import AREA, MASK, SHIFT, Tiles

UNIT = 1 / 65536  # of a cell: the unit of offsets
MAX_OFFSET = np.iinfo(np.int16).max  # an echo at the border of its cell would round to one more
MAX_ECHOES = 50  # effective length of the running mean, so that it follows what moved


class Centroids:
    """Per cell the running mean of its echoes, so that a map is finer than its cells.

    offset  layer of (x, y) from the cell's centre, int16 in UNITs of a cell; zero without an echo
    count   layer, number of echoes, uint8, up to MAX_ECHOES
    """

    def __init__(self, tiles: Tiles):
        self.tiles = tiles
        self.offset = tiles.layer(np.int16, 0, (AREA, 2))
        self.count = tiles.layer(np.uint8)

    def add(self, echoes: Array) -> None:
        """Add echoes (n, 2), m, world, all in allocated tiles."""
        tiles = self.tiles
        _add(echoes, *tiles.origin, 1 / tiles.resolution, tiles.index, self.offset.flat,
             self.count.flat)  # fmt: skip

    def dense(self) -> tuple[np.ndarray, np.ndarray]:
        """(rows, cols, 2) offsets in m, and (rows, cols) counts, of the grid `tiles.spec`."""
        offset = self.tiles.dense(self.offset) * (UNIT * self.tiles.resolution)
        return offset, self.tiles.dense(self.count)


@kernel
def _add(echoes, left, low, scale, index, offset, count):
    """Update the running means; positions in units of cells are rounded as in `rays`."""
    for k in range(len(echoes)):
        x, y = (echoes[k, 0] - left) * scale, (echoes[k, 1] - low) * scale
        row, col = int(y), int(x)
        i = index[row >> SHIFT, col >> SHIFT] * AREA + (row & MASK) * TILE + (col & MASK)
        if count[i] < MAX_ECHOES:
            count[i] += np.uint8(1)
        dx = round(((x - col - 0.5) / UNIT - offset[i, 0]) / count[i])
        dy = round(((y - row - 0.5) / UNIT - offset[i, 1]) / count[i])
        offset[i, 0] = min(offset[i, 0] + dx, MAX_OFFSET)
        offset[i, 1] = min(offset[i, 1] + dy, MAX_OFFSET)
