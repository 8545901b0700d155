"""Blocks: the squares of a tile in which layers computed from a map are updated."""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel
from slam.maps.tiles import AREA, MASK, SHIFT, TILE, Tiles

BLOCK = 8  # cells, side of a block
BLOCKS = TILE // BLOCK  # blocks along the side of a tile


class DirtyBlocks:
    """The set of blocks that have changed since the last `pop`: in the tiles of all maps, as a copy
    of a tile (`Tiles.unshare`) is as dirty as the tile. At first all blocks are in it."""

    def __init__(self, tiles: Tiles):
        self._tiles = tiles
        self._marked = tiles.layer(np.bool_, shape=(BLOCKS**2,))
        self._marked.values[1:] = True
        self._any = True

    def add(self, blocks: np.ndarray) -> None:
        """Add blocks (n, 2) of the current map, by row and column in `Tiles.index`, in blocks."""
        _mark(blocks, self._tiles.index, self._marked.values)
        self._any = self._any or len(blocks) > 0

    def pop(self) -> np.ndarray:
        """(n,) the id of the first cell of each of them; the set is empty afterwards."""
        ids = np.flatnonzero(self._marked.values)
        self._marked.flat[ids] = False
        self._any = False
        slots, (rows, cols) = ids // BLOCKS**2, divmod(ids % BLOCKS**2, BLOCKS)
        return slots * AREA + rows * (BLOCK * TILE) + cols * BLOCK

    def __bool__(self) -> bool:
        return self._any


def blocks_of(tiles: Tiles, slots: np.ndarray) -> np.ndarray:
    """(n, 2) the blocks of the tiles at `slots`, by row and column in `Tiles.index`, in blocks."""
    first = (tiles.places[slots] - tiles.corner) * BLOCKS
    within = np.indices((BLOCKS, BLOCKS)).reshape(2, -1).T
    return (first[:, None] + within).reshape(-1, 2)


@kernel
def _mark(blocks, index, marked):
    """Mark the blocks, (slots, BLOCKS^2)."""
    for k in range(len(blocks)):
        row, col = blocks[k, 0], blocks[k, 1]
        slot = index[row // BLOCKS, col // BLOCKS]
        marked[slot, (row % BLOCKS) * BLOCKS + col % BLOCKS] = True


@kernel
def cell_at(index, row, col):
    """The id of a cell by its row and column in `Tiles.index`."""
    return index[row >> SHIFT, col >> SHIFT] * AREA + ((row & MASK) << SHIFT) + (col & MASK)
