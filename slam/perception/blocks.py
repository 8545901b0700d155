"""Blocks: the squares of a tile in which what is read off a map is brought up to date."""

from __future__ import annotations

import numpy as np
from numba import njit

from slam.tiles import AREA, MASK, SHIFT, TILE, Tiles

BLOCK = 8  # cells; a block's side
BLOCKS = TILE // BLOCK


class Due:
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
        return _places(self._tiles, ids)

    def __bool__(self) -> bool:
        return any(len(ids) for ids in self._ids)


def all_blocks(tiles: Tiles) -> np.ndarray:
    """(n, 2) the blocks of all tiles in use, each by its row and column in `Tiles.index`."""
    return np.argwhere(np.kron(tiles.index > 0, np.ones((BLOCKS, BLOCKS), np.bool_)))


def _places(tiles: Tiles, ids: np.ndarray) -> np.ndarray:
    slots, within = np.divmod(ids, BLOCKS**2)
    first = (tiles.places[slots] - tiles.corner) * BLOCKS
    return first + np.stack(np.divmod(within, BLOCKS), axis=-1)


@njit(cache=True)
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


@njit(cache=True)
def cell_at(index, row, col):
    """The id of a cell by its row and column in `Tiles.index`."""
    return index[row >> SHIFT, col >> SHIFT] * AREA + ((row & MASK) << SHIFT) + (col & MASK)
