"""Tiles: sparse storage of a map, allocated only where something was observed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from slam.bounds import MAX_COORDINATE, all_within
from slam.errors import InputError
from slam.grid import TILE, GridSpec
from slam.kernel import kernel

SHIFT = 6  # the side of a tile is 1 << SHIFT cells
MASK = TILE - 1
AREA = TILE * TILE  # cells of a tile
MAX_TILES = 40_000  # that `Tiles.index` may span, allocated or not: a square of 640 m at 5 cm
INITIAL_SLOTS = 16  # of a layer
GROWTH = 2.0  # factor by which memory grows
VIEWS = "values", "flat"  # of a layer's memory


class Layer:
    """One value (or a few) for every cell of the allocated tiles. Its memory is made when it is
    first read or written.

    Slot 0 is the blank tile: it holds the fill value and is never written to.
    """

    def __init__(self, dtype: DTypeLike, fill: float, shape: tuple[int, ...], slots: int):
        self.fill, self._dtype, self._shape, self._used = fill, dtype, shape, slots

    @cached_property
    def _memory(self) -> np.ndarray:
        """(slots and room for more, AREA, ...)"""
        memory = np.empty((max(INITIAL_SLOTS, self._used), *self._shape), self._dtype)
        memory[: self._used].fill(self.fill)
        return memory

    @cached_property
    def values(self) -> np.ndarray:
        """(slots, AREA, ...) a view, valid until the next tile is allocated."""
        return self._memory[: self._used]

    @cached_property
    def flat(self) -> np.ndarray:
        """(cells, ...) likewise."""
        return self.values.reshape(-1, *self._shape[1:])

    def resize(self, slots: int) -> None:
        """Set the number of slots; new ones are blank."""
        own, used = vars(self), self._used
        self._used = slots
        if "_memory" not in own:
            return
        memory = self._memory
        if slots > len(memory):
            more = max(slots, int(GROWTH * len(memory)))
            self._memory = np.empty((more, *self._shape), self._dtype)
            self._memory[:used] = memory[:used]
        self._memory[used:slots].fill(self.fill)
        for view in VIEWS:
            own.pop(view, None)

    def __getstate__(self) -> dict[str, Any]:
        """A copy has the slots in use, and makes its views anew."""
        own = {name: value for name, value in vars(self).items() if name not in VIEWS}
        return own | {"_memory": self._memory[: self._used]}


@dataclass(eq=False)
class TileIndex:
    """The slots of one map's tiles; several maps may share the slots of `Tiles`.

    row0, col0  row and column of the lattice, in cells, at which `index` begins
    index       (tile rows, tile columns) int32 slots; 0: not allocated
    """

    row0: int = 0
    col0: int = 0
    index: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), np.int32))

    @property
    def slots(self) -> np.ndarray:
        """(n,) int32 slots of the map's tiles, each once."""
        return self.index[self.index > 0]


class Tiles:
    """Squares of TILE x TILE cells of the world's lattice, each with a slot in every layer.

    A cell's id is slot * AREA + row * TILE + column within its tile: it stays the same while the
    map grows. Tiles that are not allocated share slot 0.

    Several maps may share slots (`fork`), copy on write: a shared tile is copied before one of the
    maps writes to it (`unshare`), which changes the ids of its cells in that map. All other
    properties and methods refer to the current map.

    resolution  m, side of a cell
    current     the current map: `row0`, `col0`, `index` and what is derived from them
    used        number of slots, the blank one and the free ones included
    free        (n,) int64 slots below `used` that belong to no map; they are allocated first
    shared      whether a slot may belong to more than one map
    """

    def __init__(self, resolution: float):
        self.resolution = resolution
        self.current = TileIndex()
        self.used = 1
        self.free = np.zeros(0, np.int64)
        self.shared = False
        self._layers: list[Layer] = []
        self._places = Layer(np.int32, 0, (2,), self.used)
        self._references = Layer(np.int32, 0, (), self.used)
        self.references[0] = 1

    @property
    def row0(self) -> int:
        """Row of the lattice, in cells, where `index` begins."""
        return self.current.row0

    @property
    def col0(self) -> int:
        """Column of the lattice, in cells, where `index` begins."""
        return self.current.col0

    @property
    def index(self) -> np.ndarray:
        """(tile rows, tile columns) int32 slots; 0: not in use."""
        return self.current.index

    @property
    def places(self) -> np.ndarray:
        """(used, 2) int32 row and column of each slot's tile, in tiles of the lattice."""
        return self._places.values

    @property
    def references(self) -> np.ndarray:
        """(used,) int32 how many maps each slot is in; 1 for the blank one."""
        return self._references.values

    def layer(self, dtype: DTypeLike, fill: float = 0, shape: tuple[int, ...] = (AREA,)) -> Layer:
        """Add a layer, which grows with the tiles; `shape` is that of the values of one tile."""
        layer = Layer(dtype, fill, shape, self.used)
        self._layers.append(layer)
        return layer

    @property
    def spec(self) -> GridSpec:
        """The grid that `index` covers."""
        rows, cols = self.index.shape
        return GridSpec(self.resolution, self.row0, self.col0, rows * TILE, cols * TILE)

    @property
    def corner(self) -> tuple[int, int]:
        """Row and column of the lattice, in tiles, at which `index` begins."""
        return self.row0 // TILE, self.col0 // TILE

    @property
    def origin(self) -> tuple[float, float]:
        """World x, y in m of the lower left corner of `index`."""
        current, resolution = self.current, self.resolution  # read many times a scan
        return current.col0 * resolution, current.row0 * resolution

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles of all maps, in all layers."""
        slots = self.used - len(self.free)
        return slots * sum(layer.values[0].nbytes for layer in self._layers)

    def extend(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        """Extend `index` to cover the world box from `low` to `high`, m. Allocates no tile. Raises
        InputError for a box too large, or too far away for the int32 of `places`."""
        side, current = self.resolution * TILE, self.current
        left, below, right, above = low[0] / side, low[1] / side, high[0] / side, high[1] / side
        (rows, cols), row, col = current.index.shape, current.row0 // TILE, current.col0 // TILE
        if row <= below and above < row + rows and col <= left and right < col + cols:
            return  # as nearly always
        if not all_within((*low, *high), MAX_COORDINATE):
            raise InputError(
                f"a map reaches {MAX_COORDINATE:g} m from its origin at most, this one from {low} "
                f"to {high} m: does the odometry leap?"
            )
        first = math.floor(below), math.floor(left)
        last = math.floor(above) + 1, math.floor(right) + 1
        if rows:
            first = min(first[0], row), min(first[1], col)
            last = max(last[0], row + rows), max(last[1], col + cols)
        if (last[0] - first[0]) * (last[1] - first[1]) > MAX_TILES:
            raise InputError(
                f"a map from ({low[0]:.0f}, {low[1]:.0f}) to ({high[0]:.0f}, {high[1]:.0f}) m in "
                f"cells of {self.resolution} m spans more than {MAX_TILES} tiles of {TILE} x "
                f"{TILE} cells: does the odometry leap?"
            )
        if first == (row, col) and last == (row + rows, col + cols):
            return
        index = np.zeros((last[0] - first[0], last[1] - first[1]), np.int32)
        if rows:
            r, c = row - first[0], col - first[1]
            index[r : r + rows, c : c + cols] = self.index
        current.index, current.row0, current.col0 = index, first[0] * TILE, first[1] * TILE

    def allocate(self, used: int) -> None:
        """Make the slots newly entered into `index`, free ones and new ones up to `used`, blank
        tiles of the current map."""
        before = self.used
        self._resize(used)
        slots = _enter(self.index, self.corner, self.references, self.places)
        if len(self.free):
            reused = slots[slots < before]
            for layer in self._layers:
                layer.values[reused] = layer.fill
            self.free = self.free[len(slots) :]

    def fork(self) -> TileIndex:
        """A copy of the current map, which shares its tiles until one of the two is written to.

        Refresh sensor models first: cells integrated before the fork must not be refreshed after
        it. What map models and sensor models keep outside of layers is not copied.
        """
        fork = TileIndex(self.row0, self.col0, self.index.copy())
        self.references[fork.slots] += 1
        self.shared = True
        return fork

    def switch(self, index: TileIndex) -> None:
        """Make `index` the current map; the previous one stays as it is."""
        self.current = index

    def release(self, index: TileIndex) -> None:
        """Empty the map `index`, and free the slots that it alone had."""
        self.references[index.slots] -= 1
        index.index = np.zeros((0, 0), np.int32)
        self.free = np.flatnonzero(self.references == 0)
        self.shared = bool((self.references > 1).any())

    def unshare(self, cells: np.ndarray, wide: np.ndarray, margin: int) -> None:
        """Copy the shared tiles of `cells` (n,) before they are written to; `cells` is changed in
        place to the ids in the copies.

        wide    (n,) bool, cells whose surroundings are written to as well
        margin  cells, width of the surroundings; at most TILE
        """
        old, new = _unshare(cells, wide, margin, self.references, self.places, self.corner,
                            self.index, self.free)  # fmt: skip
        if len(old):
            self._resize(max(self.used, int(new.max()) + 1))
            self.places[new] = self.places[old]
            for layer in self._layers:
                layer.values[new] = layer.values[old]
            self.references[old] -= 1
            self.references[new] = 1
            self.free = self.free[len(new) :]

    def _resize(self, used: int) -> None:
        """Set the number of slots of all layers."""
        for layer in (*self._layers, self._places, self._references):
            layer.resize(used)
        self.used = used

    def cell(self, row: int, col: int) -> int:
        """The id of a cell by its row and column in `spec`; in the blank tile if not allocated."""
        slot = int(self.index[row >> SHIFT, col >> SHIFT])
        return slot * AREA + (row & MASK) * TILE + (col & MASK)

    def dense(self, layer: Layer) -> np.ndarray:
        """A copy of a layer as one array (rows, cols, ...) of the grid `spec`."""
        (rows, cols), values = self.index.shape, layer.values
        result = np.empty((rows * TILE, cols * TILE, *values.shape[2:]), values.dtype)
        if result.size:
            source, target = (each.reshape(-1).view(np.uint64) for each in (values, result))
            _spread(self.index, source, target)
        return result


@kernel
def _spread(index, source, target):
    """Copy the rows of cells of all tiles, as words of 8 bytes, to where they lie in one array."""
    rows, cols = index.shape
    width = len(target) // (rows * cols * TILE)  # words of a row of a tile
    for tile_row in range(rows):
        for tile_col in range(cols):
            first = index[tile_row, tile_col] * TILE
            for row in range(TILE):
                at = ((tile_row * TILE + row) * cols + tile_col) * width
                start = (first + row) * width
                for k in range(width):
                    target[np.uint64(at + k)] = source[np.uint64(start + k)]


@kernel
def next_slot(free, used, n):
    """The slot to allocate after `n` others: the free ones first, then new ones."""
    return free[n] if n < len(free) else used + n - len(free)


@kernel
def _enter(index, corner, references, places):
    """Let the slots in `index` that belong to no map yet belong to one, and write their places;
    returns them."""
    slots, n = np.empty(index.size, np.int64), 0
    for row in range(index.shape[0]):
        for col in range(index.shape[1]):
            slot = index[row, col]
            if references[slot] == 0:
                places[slot, 0], places[slot, 1] = row + corner[0], col + corner[1]
                slots[n], references[slot] = slot, 1
                n += 1
    return slots[:n]


@kernel
def _unshare(cells, wide, margin, references, places, corner, index, free):
    """Replace shared slots in `index` by new ones; returns the (n,) old ones and the new ones."""
    old, new, n = np.empty(index.size, np.int64), np.empty(index.size, np.int64), 0
    last, offset = -1, 0
    for k in range(len(cells)):
        slot = cells[k] >> (2 * SHIFT)
        if wide[k] or slot != last:
            tile_row, tile_col = places[slot, 0] - corner[0], places[slot, 1] - corner[1]
            row = (tile_row << SHIFT) + ((cells[k] >> SHIFT) & MASK)
            col = (tile_col << SHIFT) + (cells[k] & MASK)
            around = margin if wide[k] else 0
            for r in range((row - around) >> SHIFT, ((row + around) >> SHIFT) + 1):
                for c in range((col - around) >> SHIFT, ((col + around) >> SHIFT) + 1):
                    shared = index[r, c]
                    if shared < len(references) and references[shared] > 1:
                        index[r, c] = next_slot(free, len(references), n)
                        old[n], new[n] = shared, index[r, c]
                        n += 1
            last, offset = slot, (index[tile_row, tile_col] - slot) << (2 * SHIFT)
        cells[k] += offset
    return old[:n], new[:n]
