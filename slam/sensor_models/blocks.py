"""Blocks: the squares of a tile in which layers computed from a map are updated."""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel
from slam.maps.tiles import AREA, MASK, SHIFT, TILE, Tiles

BLOCK = 8  # cells, side of a block
BLOCKS = TILE // BLOCK  # blocks along the side of a tile


class DirtyBlocks:
    """The set of blocks that have changed since the last `pop`.

    For the tiles of a single map: blocks are identified by slot, which may belong to another map
    (`Tiles.fork`) by the time of `pop`.
    """

    def __init__(self, tiles: Tiles):
        self._tiles = tiles
        self._marked = tiles.layer(np.bool_, shape=(BLOCKS**2,))
        self._ids: list[np.ndarray] = []

    def add(self, blocks: np.ndarray) -> None:
        """Add blocks (n, 2), each given by its row and column in `Tiles.index`, in blocks."""
        if len(blocks):
            self._ids.append(_new(blocks, self._tiles.index, self._marked.flat))

    def pop(self) -> np.ndarray:
        """(n, 2) all of them, each once, as given to `add`; the set is empty afterwards."""
        ids = np.concatenate(self._ids)
        self._ids = []
        self._marked.flat[ids] = False
        return _places(ids, self._tiles.places, self._tiles.corner)

    def __bool__(self) -> bool:
        return any(len(ids) for ids in self._ids)


def blocks_of(tiles: Tiles, slots: np.ndarray) -> np.ndarray:
    """(n, 2) the blocks of the tiles at `slots`, by row and column in `Tiles.index`, in blocks."""
    first = (tiles.places[slots] - tiles.corner) * BLOCKS
    within = np.indices((BLOCKS, BLOCKS)).reshape(2, -1).T
    return (first[:, None] + within).reshape(-1, 2)


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
def _new(blocks, index, marked):
    """The ids, slot * BLOCKS^2 + number in the tile, of the blocks that are not marked yet."""
    ids, n = np.empty(len(blocks), np.int64), 0
    for row, col in blocks:
        slot = index[row // BLOCKS, col // BLOCKS]
        block = slot * BLOCKS**2 + (row % BLOCKS) * BLOCKS + col % BLOCKS
        ids[n] = block
        n += not marked[block]
        marked[block] = True
    return ids[:n].copy()


@kernel
def cell_at(index, row, col):
    """The id of a cell by its row and column in `Tiles.index`."""
    return index[row >> SHIFT, col >> SHIFT] * AREA + ((row & MASK) << SHIFT) + (col & MASK)
