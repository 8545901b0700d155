"""Coarser likelihood fields, and the maxima of a field over squares, computed on demand."""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel
from slam.maps.tiles import AREA, MASK, SHIFT, TILE, Layer, Tiles
from slam.sensor_models.blocks import BLOCK, DirtyBlocks

LEVELS = 3  # fields of cells 1, 2 and 4 times as wide as the map's
MAX_UNITS = 255  # of a field's span, uint8


class Pyramid:
    """Coarser fields, of cells 2 and 4 times as wide: means over squares of the field's cells. And
    the maxima over squares of 2, in units of the field's span.

    low, top  least and largest value of the field
    """

    def __init__(self, tiles: Tiles, field: Layer, unknown: float, low: float, top: float):
        self.dirty = DirtyBlocks(tiles)
        self._field = field
        self._levels = [
            tiles.layer(np.float32, unknown, (AREA >> 2 * n,)) for n in range(1, LEVELS)
        ]
        self._scale = scale_of(low, top)
        self._maxima = tiles.layer(
            np.uint8, in_units(np.float32(unknown), *self._scale), (AREA >> 2,)
        )

    def level(self, level: int) -> Layer:
        """The field of cells 1 << level times as wide."""
        self._update()
        return self._levels[level - 1]

    @property
    def maxima(self) -> Layer:
        """(slots, cells of a tile that are twice as wide) uint8, see `in_units`."""
        self._update()
        return self._maxima

    def _update(self) -> None:
        if self.dirty:
            half, quarter = (layer.values for layer in self._levels)
            maxima = self._maxima.values
            _pool(self.dirty.pop(), self._field.flat, half, quarter, maxima, self._scale)


def scale_of(low: float, top: float) -> tuple[np.float32, np.float32]:
    """The last arguments of `in_units`, by the least and the largest value of a field."""
    return np.float32(low), np.float32(MAX_UNITS / (top - low) if top > low else 0.0)


@kernel
def in_units(value, low, scale):
    """A value of a field in units of its span, rounded up."""
    units = np.ceil((value - low) * scale)
    return np.uint8(min(max(units, np.float32(0.0)), np.float32(MAX_UNITS)))


@kernel
def _pool(blocks, field, half, quarter, maxima, scale):
    """Update the means over 2 x 2 and 4 x 4 cells in the blocks, each given by its first cell, and
    the maxima over 2 x 2."""
    for first in blocks:
        _pool_block(first, field, half, quarter, maxima, scale)


@kernel
def _pool_block(first, field, half, quarter, maxima, scale):
    slot, row, col = first >> (2 * SHIFT), (first >> SHIFT) & MASK, first & MASK
    for i in range(BLOCK // 4):
        for j in range(BLOCK // 4):
            whole = np.float32(0.0)
            for r in range(2 * i, 2 * i + 2):
                for c in range(2 * j, 2 * j + 2):
                    at = first + 2 * r * TILE + 2 * c
                    mean = (field[at] + field[at + 1] + field[at + TILE] + field[at + TILE + 1]) / 4
                    place = (row // 2 + r) * (TILE // 2) + col // 2 + c
                    half[slot, place] = mean
                    most = max(field[at], field[at + 1], field[at + TILE], field[at + TILE + 1])
                    maxima[slot, place] = in_units(most, *scale)
                    whole += mean
            quarter[slot, (row // 4 + i) * (TILE // 4) + col // 4 + j] = whole / 4
