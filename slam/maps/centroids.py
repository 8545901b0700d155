"""Where in its cell an echo came from: walls do not stand at the centres of cells."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array
from slam.grid import TILE
from slam.kernel import kernel
from slam.maps.tiles import AREA, MASK, SHIFT, Tiles

UNIT = 1 / 65536  # of a cell: what offsets are counted in
LARGEST = np.iinfo(np.int16).max  # an echo just before the border of its cell rounds to one more
MEMORY = 50  # echoes that a mean looks back on at most: what moved is followed


class Centroids:
    """Per cell the mean of the echoes that fell into it, so that a map is finer than its cells.

    offset  layer of (x, y) from the cell's centre, int16 in UNITs of a cell; zero without an echo
    count   layer of echoes, uint8, up to MEMORY
    """

    def __init__(self, tiles: Tiles):
        self.tiles = tiles
        self.offset = tiles.layer(np.int16, 0, (AREA, 2))
        self.count = tiles.layer(np.uint8)

    def add(self, echoes: Array) -> None:
        """Take in echoes (n, 2), m in the world, all in tiles that are in use."""
        tiles = self.tiles
        _add(echoes, *tiles.origin, 1 / tiles.resolution, tiles.index, self.offset.flat,
             self.count.flat)  # fmt: skip

    def dense(self) -> tuple[np.ndarray, np.ndarray]:
        """(rows, cols, 2) offsets in m, and (rows, cols) counts, of the grid `tiles.spec`."""
        offset = self.tiles.dense(self.offset) * (UNIT * self.tiles.resolution)
        return offset, self.tiles.dense(self.count)


@kernel
def _add(echoes, left, low, scale, index, offset, count):
    """Running means; where an echo lies, in units of cells, is rounded as `rays` does."""
    for k in range(len(echoes)):
        x, y = (echoes[k, 0] - left) * scale, (echoes[k, 1] - low) * scale
        row, col = int(y), int(x)
        i = index[row >> SHIFT, col >> SHIFT] * AREA + (row & MASK) * TILE + (col & MASK)
        if count[i] < MEMORY:
            count[i] += np.uint8(1)
        dx = round(((x - col - 0.5) / UNIT - offset[i, 0]) / count[i])
        dy = round(((y - row - 0.5) / UNIT - offset[i, 1]) / count[i])
        offset[i, 0] = min(offset[i, 0] + dx, LARGEST)
        offset[i, 1] = min(offset[i, 1] + dy, LARGEST)
