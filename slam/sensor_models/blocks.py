"""Blocks: the squares of a tile in which what is read off a map is brought up to date."""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel
from slam.maps.tiles import AREA, MASK, SHIFT, TILE, Tiles

BLOCK = 8  # cells; a block's side
BLOCKS = TILE // BLOCK


class DirtyBlocks:
    """The blocks in which something is out of date, until someone asks for it.

    It is for tiles of one map alone: a block is told by its slot, which with several maps
    (`Tiles.fork`) another may have by the time that someone asks.
    """

    def __init__(self, tiles: Tiles):
        self._tiles = tiles
        self._noted = tiles.layer(np.bool_, shape=(BLOCKS**2,))
        self._ids: list[np.ndarray] = []

    def add(self, blocks: np.ndarray) -> None:
        """Blocks (n, 2), each given by its row and column in `Tiles.index`, have changed."""
        self._ids.append(_new(blocks, self._tiles.index, self._noted.flat))

    def take(self) -> np.ndarray:
        """(n, 2) all of them, each once; then there are none."""
        ids = np.concatenate(self._ids)
        self._ids = []
        self._noted.flat[ids] = False
        return _places(ids, self._tiles.places, self._tiles.corner)

    def __bool__(self) -> bool:
        return any(len(ids) for ids in self._ids)


def all_blocks(tiles: Tiles) -> np.ndarray:
    """(n, 2) the blocks of all tiles in use, each by its row and column in `Tiles.index`."""
    return np.argwhere(np.kron(tiles.index > 0, np.ones((BLOCKS, BLOCKS), np.bool_)))


@kernel
def _places(ids, places, corner):
    """(n, 2) row and column in `Tiles.index`, in blocks."""
    blocks = np.empty((len(ids), 2), np.int64)
    for k in range(len(ids)):
        slot, within = ids[k] // BLOCKS**2, ids[k] % BLOCKS**2
        blocks[k, 0] = (places[slot, 0] - corner[0]) * BLOCKS + within // BLOCKS
        blocks[k, 1] = (places[slot, 1] - corner[1]) * BLOCKS + within % BLOCKS
    return blocks


@kernel
def _new(blocks, index, noted):
    """The ids, slot * BLOCKS^2 + place in the tile, of the blocks that are not noted yet."""
    ids, n = np.empty(len(blocks), np.int64), 0
    for row, col in blocks:
        slot = index[row // BLOCKS, col // BLOCKS]
        one = slot * BLOCKS**2 + (row % BLOCKS) * BLOCKS + col % BLOCKS
        ids[n] = one
        n += not noted[one]
        noted[one] = True
    return ids[:n].copy()


@kernel
def cell_at(index, row, col):
    """The id of a cell by its row and column in `Tiles.index`."""
    return index[row >> SHIFT, col >> SHIFT] * AREA + ((row & MASK) << SHIFT) + (col & MASK)
