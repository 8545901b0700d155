"""Tiles: a map's memory, which holds what was seen and nothing of the space between."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from slam.errors import InputError
from slam.grid import TILE, GridSpec
from slam.kernel import kernel

SHIFT = 6  # 1 << SHIFT cells are a tile's side
MASK = TILE - 1
AREA = TILE * TILE
MOST_TILES = 40_000  # that a map may span, seen or not: a square of 640 m at 5 cm
FIRST = 16  # tiles that a layer has room for at the beginning
GROWTH = 2.0


class Layer:
    """One value (or a few) for every cell of the tiles in use. Slot 0 is the blank tile, which
    nobody writes to.

    values  (slots, AREA, ...) a view, good until the next tile is taken into use
    flat    (cells, ...) likewise
    """

    def __init__(self, dtype: DTypeLike, fill: float, shape: tuple[int, ...]):
        self.fill = fill
        self._memory = np.empty((FIRST, *shape), dtype)
        self._used = 0
        self.hold(0)

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
        self._view()

    def _view(self) -> None:
        self.values = self._memory[: self._used]
        self.flat = self.values.reshape(math.prod(self.values.shape[:2]), *self._memory.shape[2:])

    def __setstate__(self, state: dict[str, Any]) -> None:
        """A copy looks at its own memory."""
        self.__dict__.update(state)
        self._view()


@dataclass(eq=False)
class TileIndex:
    """One map among those that share the slots of `Tiles`: which tiles it is made of.

    row0, col0  of the lattice, in cells: where `index` begins
    index       (tile rows, tile columns) int32 slots; 0: not in use
    """

    row0: int = 0
    col0: int = 0
    index: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), np.int32))

    @property
    def slots(self) -> np.ndarray:
        """(n,) int32 in use, each once."""
        return self.index[self.index > 0]


class Tiles:
    """Squares of TILE x TILE cells of the world's lattice, each with a slot in every layer.

    A cell's id is slot * AREA + row * TILE + column within its tile: it never changes, however far
    the map grows. Tiles that nothing was seen of share slot 0.

    Several maps may share the slots (`fork`): a tile is copied when one of them is about to write
    to it (`own`), and only then do its cells have new ids. All else speaks of the current map.

    resolution  m, side of a cell
    current     the map that `row0`, `col0`, `index` and all that follows from them are of
    used        slots that there are, the blank one and the free ones counted in
    free        (n,) int64 slots below `used` that no map has: the next to be taken
    shared      whether a slot may be in more than one map
    """

    def __init__(self, resolution: float):
        self.resolution = resolution
        self.current = TileIndex()
        self.used = 1
        self.free = np.zeros(0, np.int64)
        self.shared = False
        self._layers: list[Layer] = []
        self._places = Layer(np.int32, 0, (2,))
        self._references = Layer(np.int32, 0, ())
        self._hold(1)
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
        """Bytes of the tiles in use by any map, in all layers."""
        slots = self.used - len(self.free)
        return slots * sum(layer.values[0].nbytes for layer in self._layers)

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
        current = self.current
        current.index, current.row0, current.col0 = index, first[0] * TILE, first[1] * TILE

    def take(self, used: int) -> None:
        """Slots entered into `index`, free ones and new ones up to `used`, are in use now: blank in
        every layer."""
        before = self.used
        self._hold(used)
        slots, places = _new(self.index, self.references)
        self.places[slots] = places + self.corner
        again = slots[slots < before]
        for layer in self._layers if len(again) else ():
            layer.values[again] = layer.fill
        self._refer(slots)

    def fork(self) -> TileIndex:
        """A map that is what the current one is now; the two go different ways from here on.

        Readings must be up to date: what was integrated before is not to be refreshed after. What
        map models and readings keep outside of layers is not divided.
        """
        branch = TileIndex(self.row0, self.col0, self.index.copy())
        self.references[branch.slots] += 1
        self.shared = True
        return branch

    def switch(self, branch: TileIndex) -> None:
        """Make `branch` the current map; the one that was stays as it is."""
        self.current = branch

    def drop(self, branch: TileIndex) -> None:
        """Nobody needs `branch` any more: it is empty, and slots that it alone had are free."""
        self.references[branch.slots] -= 1
        branch.index = np.zeros((0, 0), np.int32)
        self.free = np.flatnonzero(self.references == 0)
        self.shared = bool((self.references > 1).any())

    def own(self, cells: np.ndarray, wide: np.ndarray, margin: int) -> None:
        """Let the current map share no tile that is written to when `cells` (n,) are, changing the
        ids to those of the copies.

        wide    (n,) bool, cells around which is written too
        margin  cells, how far; at most TILE
        """
        old, new = _own(cells, wide, margin, self.references, self.places, self.corner, self.index,
                        self.free)  # fmt: skip
        if len(old):
            self._hold(max(self.used, int(new.max()) + 1))
            self.places[new] = self.places[old]
            for layer in self._layers:
                layer.values[new] = layer.values[old]
            self.references[old] -= 1
            self._refer(new)

    def _hold(self, used: int) -> None:
        """Have so many slots."""
        for layer in (*self._layers, self._places, self._references):
            layer.hold(used)
        self.used = used

    def _refer(self, slots: np.ndarray) -> None:
        """The slots, those that were to be taken first, are in the current map."""
        self.references[slots] = 1
        self.free = self.free[len(slots) :]

    def cell(self, row: int, col: int) -> int:
        """The id of a cell given by its row and column in `spec`; in the blank tile if unused."""
        slot = int(self.index[row >> SHIFT, col >> SHIFT])
        return slot * AREA + (row & MASK) * TILE + (col & MASK)

    def dense(self, layer: Layer) -> np.ndarray:
        """A copy of a layer as one array (rows, cols, ...) of the grid `spec`."""
        rows, cols = self.index.shape
        tiles = layer.values.reshape(-1, TILE, TILE, *layer.values.shape[2:])[self.index]
        return np.moveaxis(tiles, 2, 1).reshape(rows * TILE, cols * TILE, *tiles.shape[4:])


@kernel
def slot_to_take(free, used, n):
    """The slot to take after `n` others: the free ones first, then new ones."""
    return free[n] if n < len(free) else used + n - len(free)


@kernel
def _new(index, references):
    """The slots in `index` that no map has yet, and their tiles' (n, 2) rows and columns there."""
    slots, places, n = np.empty(index.size, np.int64), np.empty((index.size, 2), np.int64), 0
    for row in range(index.shape[0]):
        for col in range(index.shape[1]):
            if references[index[row, col]] == 0:
                slots[n], places[n, 0], places[n, 1] = index[row, col], row, col
                n += 1
    return slots[:n], places[:n]


@kernel
def _own(cells, wide, margin, references, places, corner, index, free):
    """Enter new slots for shared ones; gives the (n,) old ones and the new ones."""
    old, new, n = np.empty(index.size, np.int64), np.empty(index.size, np.int64), 0
    last, further = -1, 0
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
                        index[r, c] = slot_to_take(free, len(references), n)
                        old[n], new[n] = shared, index[r, c]
                        n += 1
            last, further = slot, (index[tile_row, tile_col] - slot) << (2 * SHIFT)
        cells[k] += further
    return old[:n], new[:n]
