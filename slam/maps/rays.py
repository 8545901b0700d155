"""Ray tracing: the cells that a scan observes as free and as occupied."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.grid import TILE
from slam.kernel import kernel
from slam.maps.tiles import AREA, SHIFT, Tiles, next_slot
from slam.scan import Scan
from slam.validation import positive, within

TILE_MARGIN = 8  # cells around every echo whose tiles are allocated too: sensor models read them
INDEX_MARGIN = 32  # cells around the scan that `Tiles.index` covers, allocated or not
WINDOW_MARGIN = 2  # cells around the window of a scan, for rounding errors
SHORTEST_ROW = 3  # beams without an echo that show that nothing is there, where none is missed
BY_CHANCE = 0.05  # longer rows that a scan of missed echoes has, on average
FREE, HIT = np.uint8(1), np.uint8(2)
WORD = 1 << 3  # marks that are tested at once
ALL_HIT = np.uint64(0x0202020202020202)  # a word of cells that are all HIT
U_WORDS = np.uint64(TILE // WORD)  # in a row of a tile
U_1, U_3 = np.uint64(1), np.uint64(3)  # unsigned: numba need not check the sign


class ObservedCells(NamedTuple):
    """The cells that one scan observes, each once: occupied if a beam ends there, else free.

    cells   (n,) int64 ids (see `Tiles`)
    hit     (n,) bool, occupied rather than free
    echoes  (m, 2) end points of the beams that hit, m, world
    """

    cells: np.ndarray
    hit: np.ndarray
    echoes: Array


@dataclass(frozen=True)
class Rays:
    """The maximum ranges up to which beams update a map.

    reach          m; a beam with an echo farther away marks cells as free up to here
    no_echo_reach  m; a beam without echo marks cells as free up to here, or to the sensor's maximum
                   range if that is less: glass and dark walls give no echo either. It marks none
                   unless it is inside a row of at least three such beams, or of more where single
                   ones are frequent: lasers miss echoes of walls (up to half of them)
    """

    reach: float = 30.0
    no_echo_reach: float = 8.0

    def __post_init__(self) -> None:
        positive(self, "reach")
        within(self, "no_echo_reach", 0.0)

    def ends(self, scan: Scan, pose: Pose2) -> tuple[Array, Array, np.ndarray]:
        """The sensor (2,) and the beams' end points (n, 2), m, world; which are hits, (n,) bool."""
        return _ends(scan.ranges, scan.directions, scan.hit, scan.no_echo, self.reach,
                     min(self.no_echo_reach, scan.max_range), scan.mount.x, scan.mount.y,
                     *pose)  # fmt: skip


class Tracer:
    """Traces beams through tiles. Its buffer is reused, and all zero between two scans."""

    def __init__(self) -> None:
        self._marks = np.zeros(0, np.uint8)

    def trace(self, tiles: Tiles, sensor: Array, ends: Array, hit: np.ndarray) -> ObservedCells:
        """The cells that beams from `sensor` (2,) to `ends` (n, 2) cross (free) or end in (hit).

        Allocates their tiles. The last cell of a beam that is no hit is free too.
        """
        left, low, right, high = _box(sensor, ends)
        margin = INDEX_MARGIN * tiles.resolution
        tiles.extend((left - margin, low - margin), (right + margin, high + margin))
        (x, y), scale = tiles.origin, 1 / tiles.resolution
        row0 = (math.floor((low - y) * scale) - WINDOW_MARGIN) >> SHIFT
        col0 = (math.floor((left - x) * scale) - WINDOW_MARGIN) >> SHIFT
        row1 = (math.floor((high - y) * scale) + WINDOW_MARGIN) >> SHIFT
        col1 = (math.floor((right - x) * scale) + WINDOW_MARGIN) >> SHIFT
        pitch = ((col1 - col0 + 1) | 1) << SHIFT
        size = ((row1 - row0 + 1) << SHIFT) * pitch
        if size > len(self._marks):
            self._marks = np.zeros(size, np.uint8)
        cells, flags, echoes, taken = _trace(
            sensor,
            ends,
            hit,
            x,
            y,
            scale,
            self._marks,
            pitch,
            (row0, row1, col0, col1),
            tiles.index,
            tiles.free,
            tiles.used,
        )
        if taken:
            tiles.allocate(tiles.used + max(taken - len(tiles.free), 0))
        return ObservedCells(cells, flags, echoes)


@kernel
def _ends(ranges, directions, hit, no_echo, reach, clear, mount_x, mount_y, x, y, theta):
    c, s = np.cos(theta), np.sin(theta)
    x, y = x + c * mount_x - s * mount_y, y + s * mount_x + c * mount_y
    ends, hits = np.empty((len(ranges), 2)), np.empty(len(ranges), np.bool_)
    clears, n = _clear(hit, no_echo), 0
    for k in range(len(ranges)):
        if hit[k] or clears[k]:
            length = min(ranges[k], reach) if hit[k] else clear
            ends[n, 0] = x + length * (c * directions[k, 0] - s * directions[k, 1])
            ends[n, 1] = y + length * (s * directions[k, 0] + c * directions[k, 1])
            hits[n] = hit[k] and ranges[k] <= reach
            n += 1
    return np.array([x, y]), ends[:n], hits[:n]


@kernel
def _clear(hit, no_echo):
    """(n,) bool, the beams that show that nothing is there: inside a row of beams without an echo
    that is longer than rows of missed echoes are by chance."""
    least, last = _shortest_row(hit, no_echo), len(no_echo) - 1
    clears, k = np.zeros(len(no_echo), np.bool_), 0
    while k <= last:
        begin = k
        while k <= last and no_echo[k]:
            k += 1
        at_border = (begin == 0) + (k > last)  # there the row may go on
        if k - begin + at_border >= least:
            clears[begin + (begin > 0) : k - (k <= last)] = True
        k += 1
    return clears


@kernel
def _shortest_row(hit, no_echo):
    """The number of beams without an echo in a row that are not all misses, if echoes are missed
    independently, and as often as beams between two with an echo have none."""
    echoes, single = 1, 0
    for k in range(1, len(hit) - 1):
        echoes += hit[k]
        single += no_echo[k] and hit[k - 1] and hit[k + 1]
    if single == 0:
        return SHORTEST_ROW
    missed = (1.0 - np.sqrt(max(1.0 - 4.0 * single / echoes, 0.0))) / 2.0  # single: p (1 - p)
    return max(SHORTEST_ROW, int(np.ceil(np.log(BY_CHANCE / len(hit)) / np.log(missed))))


@kernel
def _box(sensor, ends):
    """Left, low, right and high border of a sensor and the end points of its beams."""
    left, low = sensor[0], sensor[1]
    right, high = left, low
    for k in range(len(ends)):
        left, right = min(left, ends[k, 0]), max(right, ends[k, 0])
        low, high = min(low, ends[k, 1]), max(high, ends[k, 1])
    return left, low, right, high


@kernel
def _trace(sensor, ends, hit, x, y, scale, marks, pitch, window, index, free, used):
    """Trace every beam, in units of cells from the corner of a window, whose marks are reset to 0.

    Returns the cells tile by tile, which of them are hit, the end points of the beams that hit, and
    how many slots were entered into `index`.

    x, y    m, where `index` begins
    scale   cells per m
    pitch   columns of the window, an odd number of tiles: rows apart by a power of two share few
            lines of the processor's cache
    window  first and last row, first and last column of tiles in `index`
    """
    row0, row1, col0, col1 = window
    left, low = col0 << SHIFT, row0 << SHIFT
    x0, y0 = (sensor[0] - x) * scale - left, (sensor[1] - y) * scale - low
    most = 1
    for k in range(len(ends)):
        x1, y1 = (ends[k, 0] - x) * scale - left, (ends[k, 1] - y) * scale - low
        _follow(marks, pitch, x0, y0, x1, y1)
        most += abs(int(x1) - int(x0)) + abs(int(y1) - int(y0)) + 1
    echoes = ends[hit]
    taken = 0
    for k in range(len(echoes)):
        row, col = int((echoes[k, 1] - y) * scale - low), int((echoes[k, 0] - x) * scale - left)
        marks[np.uint64(row * pitch + col)] = HIT
        if not _allocated_around(low + row, left + col, index):
            taken = _allocate_around(low + row, left + col, index, free, used, taken)
    cells, flags, n = np.empty(most, np.int64), np.zeros(most, np.bool_), 0
    words = marks.view(np.uint64)
    for r in range(row0, row1 + 1):
        for c in range(col0, col1 + 1):
            corner = ((r - row0) * pitch + c - col0) << SHIFT
            for line in range(TILE):  # in this loop: calls count references to arrays
                start, marked = np.uint64((corner + line * pitch) >> 3), np.uint64(0)
                for w in range(U_WORDS):
                    marked |= words[start + w]
                if not marked:
                    continue
                if index[r, c] == 0:
                    taken = _allocate(r, c, index, free, used, taken)
                first = index[r, c] * AREA + line * TILE
                for w in range(U_WORDS):
                    word = words[start + w]
                    if not word:
                        continue
                    hits, begin = word & ALL_HIT, first + WORD * np.int64(w)
                    for k in range(WORD):
                        mark = marks[((start + w) << U_3) + np.uint64(k)]
                        cells[n] = begin + k
                        if hits:
                            flags[n] = mark == HIT
                        n += mark != 0
                    words[start + w] = 0
    return cells[:n], flags[:n], echoes, taken


@kernel
def _allocated_around(row, col, index):
    """Whether the tiles within TILE_MARGIN of a cell are allocated."""
    r, below = (row + TILE_MARGIN) >> SHIFT, (row - TILE_MARGIN) >> SHIFT
    c, before = (col + TILE_MARGIN) >> SHIFT, (col - TILE_MARGIN) >> SHIFT
    return index[r, c] and index[r, before] and index[below, c] and index[below, before]


@kernel
def _allocate_around(row, col, index, free, used, taken):
    """Allocate the tiles within TILE_MARGIN of a cell; returns how many slots were taken so far."""
    for r in ((row - TILE_MARGIN) >> SHIFT, (row + TILE_MARGIN) >> SHIFT):
        for c in ((col - TILE_MARGIN) >> SHIFT, (col + TILE_MARGIN) >> SHIFT):
            taken = _allocate(r, c, index, free, used, taken)
    return taken


@kernel
def _allocate(row, col, index, free, used, taken):
    """Allocate a tile, if it is not; returns how many slots were taken so far."""
    if index[row, col] == 0:
        index[row, col] = next_slot(free, used, taken)
        taken += 1
    return taken


@kernel
def _follow(marks, pitch, x0, y0, x1, y1):
    """Mark the cells of one beam: in each row (or column, along the beam's major axis) the cell
    where it enters and the cell where it leaves."""
    row = np.uint64(pitch)
    if abs(x1 - x0) >= abs(y1 - y0):
        _walk(marks, U_1, row, x0, y0, x1, y1)
    else:
        _walk(marks, row, U_1, y0, x0, y1, x1)
    marks[np.uint64(int(y1)) * row + np.uint64(int(x1))] = FREE


@kernel
def _walk(marks, along, across, u0, v0, u1, v1):
    """Mark the cells from (u0, v0) to (u1, v1), u being the major axis; `along` and `across` are
    the strides of the marks in u and in v."""
    step, ahead = (1, 1) if u1 > u0 else (-1, 0)
    slope = (v1 - v0) / (u1 - u0) if u1 != u0 else 0.0
    low, high = min(int(v0), int(v1)), max(int(v0), int(v1))
    line = np.uint64(int(v0)) * across
    for u in range(int(u0), int(u1), step):
        marks[np.uint64(u) * along + line] = FREE
        line = np.uint64(min(max(int(v0 + (u + ahead - u0) * slope), low), high)) * across
        marks[np.uint64(u) * along + line] = FREE
    marks[np.uint64(int(u1)) * along + line] = FREE
