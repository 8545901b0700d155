"""Coarser likelihood fields, computed on demand."""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel
from slam.maps.tiles import AREA, MASK, SHIFT, TILE, Layer, Tiles
from slam.sensor_models.blocks import BLOCK, DirtyBlocks, blocks_of, cell_at

LEVELS = 3  # fields of cells 1, 2 and 4 times as wide as the map's


class Means:
    """Coarser fields, of cells 2 and 4 times as wide: means over squares of the field's cells."""

    def __init__(self, tiles: Tiles, field: Layer, unknown: float):
        self.dirty = DirtyBlocks(tiles)
        self.dirty.add(blocks_of(tiles, tiles.current.slots))
        self._tiles, self._field = tiles, field
        self._levels = [
            tiles.layer(np.float32, unknown, (AREA >> 2 * n,)) for n in range(1, LEVELS)
        ]

    def level(self, level: int) -> Layer:
        """The field of cells 1 << level times as wide."""
        if self.dirty:
            half, quarter = (layer.values for layer in self._levels)
            _pool(self.dirty.pop(), self._tiles.index, self._field.flat, half, quarter)
        return self._levels[level - 1]


@kernel
def _pool(blocks, index, field, half, quarter):
    """Update the means over 2 x 2 and 4 x 4 cells in the blocks."""
    for b in range(len(blocks)):
        first = cell_at(index, blocks[b, 0] * BLOCK, blocks[b, 1] * BLOCK)
        _pool_block(first, field, half, quarter)


@kernel
def _pool_block(first, field, half, quarter):
    slot, row, col = first >> (2 * SHIFT), (first >> SHIFT) & MASK, first & MASK
    for i in range(BLOCK // 4):
        for j in range(BLOCK // 4):
            whole = np.float32(0.0)
            for r in range(2 * i, 2 * i + 2):
                for c in range(2 * j, 2 * j + 2):
                    at = first + 2 * r * TILE + 2 * c
                    mean = (field[at] + field[at + 1] + field[at + TILE] + field[at + TILE + 1]) / 4
                    half[slot, (row // 2 + r) * (TILE // 2) + col // 2 + c] = mean
                    whole += mean
            quarter[slot, (row // 4 + i) * (TILE // 4) + col // 4 + j] = whole / 4
