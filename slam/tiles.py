"""Tiles: a map's memory, which holds what was seen and nothing of the space between."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import DTypeLike

from slam.errors import InputError
from slam.grid import TILE, GridSpec

SHIFT = 6  # 1 << SHIFT cells are a tile's side
MASK = TILE - 1
AREA = TILE * TILE
MOST_TILES = 40_000  # that a map may span, seen or not: a square of 640 m at 5 cm
FIRST = 16  # tiles that a layer has room for at the beginning
GROWTH = 1.3


class Layer:
    """One value (or a few) for every cell of the tiles in use. Slot 0 is the blank tile, which
    nobody writes to."""

    def __init__(self, dtype: DTypeLike, fill: float, shape: tuple[int, ...]):
        self.fill = fill
        self._memory = np.empty((FIRST, *shape), dtype)
        self._used = 0

    @property
    def values(self) -> np.ndarray:
        """(slots, AREA, ...) a view, good until the next tile is taken into use."""
        return self._memory[: self._used]

    @property
    def flat(self) -> np.ndarray:
        """(cells, ...) a view, good until the next tile is taken into use."""
        return self.values.reshape(-1, *self._memory.shape[2:])

    def hold(self, slots: int) -> None:
        """Have so many tiles; new ones are blank."""
        have = len(self._memory)
        if slots > have:
            grown = np.empty((max(slots, int(GROWTH * have)), *self._memory.shape[1:]),
                             self._memory.dtype)  # fmt: skip
            grown[: self._used] = self.values
            self._memory = grown
        self._memory[self._used : slots] = self.fill
        self._used = slots


class Tiles:
    """Squares of TILE x TILE cells of the world's lattice, each with a slot in every layer.

    A cell's id is slot * AREA + row * TILE + column within its tile: it never changes, however far
    the map grows. Tiles that nothing was seen of share slot 0.

    resolution  m, side of a cell
    row0, col0  of the lattice, in cells: where `index` begins
    index       (tile rows, tile columns) int32 slots; 0: not in use
    used        slots in use, the blank one counted in
    places      (used, 2) int32 row and column of each slot's tile, in tiles of the lattice
    """

    def __init__(self, resolution: float):
        self.resolution = resolution
        self.row0 = self.col0 = 0
        self.index = np.zeros((0, 0), np.int32)
        self.used = 1
        self.places = np.zeros((1, 2), np.int32)
        self._layers: list[Layer] = []

    def layer(self, dtype: DTypeLike, fill: float = 0, shape: tuple[int, ...] = (AREA,)) -> Layer:
        """A new layer; it grows with the tiles. `shape` is what it keeps of one tile."""
        layer = Layer(dtype, fill, shape)
        layer.hold(self.used)
        self._layers.append(layer)
        return layer

    @property
    def spec(self) -> GridSpec:
        """The grid that all tiles, used or not, lie in."""
        rows, cols = self.index.shape
        return GridSpec(self.resolution, self.row0, self.col0, rows * TILE, cols * TILE)

    @property
    def corner(self) -> tuple[int, int]:
        """Row and column, in tiles of the lattice, of where `index` begins."""
        return self.row0 // TILE, self.col0 // TILE

    @property
    def origin(self) -> tuple[float, float]:
        """World x, y in m of the lower left corner of `index`."""
        return self.col0 * self.resolution, self.row0 * self.resolution

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles in use, in all layers."""
        return self.used * sum(layer.values[0].nbytes for layer in self._layers)

    def cover(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        """Let `index` reach over the world box from `low` to `high`, m. No tile is taken."""
        side = self.resolution * TILE
        first = math.floor(low[1] / side), math.floor(low[0] / side)
        last = math.floor(high[1] / side) + 1, math.floor(high[0] / side) + 1
        rows, cols = self.index.shape
        row, col = self.row0 // TILE, self.col0 // TILE
        if rows:
            first = min(first[0], row), min(first[1], col)
            last = max(last[0], row + rows), max(last[1], col + cols)
        if (last[0] - first[0]) * (last[1] - first[1]) > MOST_TILES:
            raise InputError(
                f"a map from ({low[0]:.0f}, {low[1]:.0f}) to ({high[0]:.0f}, {high[1]:.0f}) m in "
                f"cells of {self.resolution} m spans more than {MOST_TILES} tiles of {TILE} x "
                f"{TILE} cells: does the odometry leap?"
            )
        if first == (row, col) and last == (row + rows, col + cols):
            return
        index = np.zeros((last[0] - first[0], last[1] - first[1]), np.int32)
        if rows:
            r, c = row - first[0], col - first[1]
            index[r : r + rows, c : c + cols] = self.index
        self.index, self.row0, self.col0 = index, first[0] * TILE, first[1] * TILE

    def take(self, used: int) -> None:
        """Slots up to `used`, entered into `index`, are in use now: make room in every layer."""
        new = np.argwhere(self.index >= self.used)
        places = np.zeros((used, 2), np.int32)
        places[: self.used] = self.places
        places[self.index[tuple(new.T)]] = new + self.corner
        for layer in self._layers:
            layer.hold(used)
        self.used, self.places = used, places

    def cell(self, row: int, col: int) -> int:
        """The id of a cell given by its row and column in `spec`; in the blank tile if unused."""
        slot = int(self.index[row >> SHIFT, col >> SHIFT])
        return slot * AREA + (row & MASK) * TILE + (col & MASK)

    def dense(self, layer: Layer) -> np.ndarray:
        """A copy of a layer as one array (rows, cols, ...) of the grid `spec`."""
        rows, cols = self.index.shape
        tiles = layer.values.reshape(-1, TILE, TILE, *layer.values.shape[2:])[self.index]
        return np.moveaxis(tiles, 2, 1).reshape(rows * TILE, cols * TILE, *tiles.shape[4:])
