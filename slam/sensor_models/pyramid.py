"""Layers computed from a likelihood field on demand: upper bounds and coarser fields."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Array
from slam.kernel import kernel
from slam.maps.tiles import AREA, MASK, SHIFT, TILE, Layer, Tiles
from slam.sensor_models.blocks import BLOCK, BLOCKS, DirtyBlocks, all_blocks, cell_at

PEAK_RADIUS = 2  # cells around a square whose samples its peak is the maximum of
SQUARES = BLOCK // 2 + PEAK_RADIUS  # along a side, whose peaks depend on a block
WINDOW = BLOCK + 4 * PEAK_RADIUS  # cells along a side that these peaks depend on
U_1, U_MASK, U_SHIFT = np.uint64(1), np.uint64(MASK), np.uint64(SHIFT)  # no index is sign-checked
LEVELS = 3  # fields of cells 1, 2 and 4 times as wide as the map's


class Peaks:
    """Upper bounds: the maximum of the field within PEAK_RADIUS of each square of 2 x 2 cells.

    As uint8, rounded up to 1/255 of the field's span.

    unknown, low, high  the field's value at unknown cells, its minimum and its maximum
    """

    def __init__(self, tiles: Tiles, field: Layer, unknown: float, low: float, high: float):
        self.dirty = DirtyBlocks(tiles)
        self.dirty.add(all_blocks(tiles))
        self._tiles, self._field, self._unknown = tiles, field, unknown
        self._low, self._step = low, (high - low) / 255
        height = math.ceil((unknown - low) / self._step)
        self._peaks = tiles.layer(np.uint8, height, (AREA // 4,))

    def bounds(self, points: Array, poses: Array, reach: float) -> Array:
        """(n,) upper bound of the sum of the field at the points (in the robot's frame), over all
        poses within `reach` m, in x and in y, of each of the poses, with the same heading."""
        tiles = self._tiles
        if self.dirty:
            rows, cols = tiles.index.shape
            padded = np.zeros((rows + 2, cols + 2), np.int32)  # peaks beyond the border change too
            padded[1:-1, 1:-1] = tiles.index
            _update_peaks(self.dirty.pop() + BLOCKS, padded, self._field.flat, self._peaks.values,
                          self._low, 1 / self._step)  # fmt: skip
        return _bounds(poses, points, tiles.index, self._peaks.values, tiles.origin,
                       tiles.resolution, self._unknown, self._low, self._step, reach)  # fmt: skip


class Means:
    """Coarser fields, of cells 2 and 4 times as wide: means over squares of the field's cells."""

    def __init__(self, tiles: Tiles, field: Layer, unknown: float):
        self.dirty = DirtyBlocks(tiles)
        self.dirty.add(all_blocks(tiles))
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


@kernel
def _update_peaks(blocks, index, field, peaks, low, scale):
    """Update the peaks that depend on the field in the blocks."""
    window, high = np.empty((WINDOW, WINDOW), np.float32), np.empty((SQUARES, WINDOW), np.float32)
    for b in range(len(blocks)):
        row, col = blocks[b, 0] * BLOCK - 2 * PEAK_RADIUS, blocks[b, 1] * BLOCK - 2 * PEAK_RADIUS
        _look(index, field, row, col, window)
        for i in range(SQUARES):
            high[i] = window[2 * i]
            for r in range(2 * i + 1, 2 * i + 2 + 2 * PEAK_RADIUS):
                for c in range(WINDOW):
                    high[i, c] = window[r, c] if window[r, c] > high[i, c] else high[i, c]
        for i in range(SQUARES):
            for j in range(SQUARES):
                top = high[i, 2 * j]
                for c in range(2 * j + 1, 2 * j + 2 + 2 * PEAK_RADIUS):
                    top = high[i, c] if high[i, c] > top else top
                r, c = row + 2 * i + PEAK_RADIUS, col + 2 * j + PEAK_RADIUS
                slot = index[r >> SHIFT, c >> SHIFT]
                if slot:
                    place = ((r & MASK) >> 1) * (TILE // 2) + ((c & MASK) >> 1)
                    peaks[slot, place] = np.uint8(min(np.ceil((top - low) * scale), 255.0))


@kernel
def _look(index, field, row, col, window):
    """Copy the field from a row and a column on, of at most two tiles in a row, to a window."""
    border = ((col >> SHIFT) + 1) << SHIFT
    for r in range(WINDOW):
        left = cell_at(index, row + r, col)
        right = cell_at(index, row + r, col + WINDOW - 1) - (WINDOW - 1)
        for c in range(WINDOW):
            window[r, c] = field[np.uint64((left if col + c < border else right) + c)]


@kernel
def _bounds(poses, points, index, peaks, origin, resolution, unknown, low, step, reach):
    scale = 1.0 / resolution
    extra = max(int(np.ceil((reach * scale - 1.0) / 2.0)), 0)
    rows, cols = float(index.shape[0] << SHIFT), float(index.shape[1] << SHIFT)
    result = np.empty(len(poses))
    for n in range(len(poses)):
        c, s = np.cos(poses[n, 2]) * scale, np.sin(poses[n, 2]) * scale
        x0, y0 = (poses[n, 0] - origin[0]) * scale, (poses[n, 1] - origin[1]) * scale
        total = 0.0
        for k in range(len(points)):
            x = x0 + c * points[k, 0] - s * points[k, 1]
            y = y0 + s * points[k, 0] + c * points[k, 1]
            if extra:
                total += _highest(x, y, extra, index, peaks, rows, cols, unknown, low, step)
            elif x >= 0.0 and y >= 0.0 and x < cols and y < rows:
                total += low + step * _peak(x, y, index, peaks)
            else:
                total += unknown
        result[n] = total
    return result


@kernel
def _highest(x, y, extra, index, peaks, rows, cols, unknown, low, step):
    """The largest bound of the squares up to `extra` squares away."""
    top = -np.inf
    for dr in range(-extra, extra + 1):
        for dc in range(-extra, extra + 1):
            i, j = y + 2 * dr, x + 2 * dc
            if 0.0 <= j < cols and 0.0 <= i < rows:
                top = max(top, low + step * _peak(j, i, index, peaks))
            else:
                top = max(top, unknown)
    return top


@kernel
def _peak(x, y, index, peaks):
    i, j = np.uint64(np.int64(y)), np.uint64(np.int64(x))
    slot = np.uint64(index[i >> U_SHIFT, j >> U_SHIFT])
    row, col = (i & U_MASK) >> U_1, (j & U_MASK) >> U_1
    return peaks[slot, (row << (U_SHIFT - U_1)) + col]
