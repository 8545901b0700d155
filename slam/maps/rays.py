"""Which cells a scan saw free and which it saw occupied: the ground of every map model."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from slam.checked import positive, within
from slam.geometry import Array, Pose2
from slam.scan import Scan
from slam.tiles import MASK, SHIFT, Tiles, slot_to_take

MARGIN = 8  # cells around every echo whose tiles are taken too: readings look so far
AROUND = 32  # cells around all that was seen that lie in `Tiles.index`, taken or not
SPARE = 2  # cells around the window of a scan
NEVER = 1e30  # a border that a beam along it does not meet
FREE, HIT = np.uint8(1), np.uint8(2)


class Seen(NamedTuple):
    """What one scan says of the cells, each cell once; a hit outweighs the beams that pass it.

    cells   (n,) int64 ids (see `Tiles`)
    hit     (n,) bool, occupied rather than free
    echoes  (m, 2) where the beams that hit ended, m, world
    """

    cells: np.ndarray
    hit: np.ndarray
    echoes: Array


@dataclass(frozen=True)
class Rays:
    """How far a scan is believed.

    reach          m, echoes from farther away only clear the way up to here
    no_echo_reach  m, a beam without echo clears the way up to here (or to the sensor's maximum
                   range where that is less): glass and dark walls give no echo either
    """

    reach: float = 30.0
    no_echo_reach: float = 8.0

    def __post_init__(self) -> None:
        positive(self, "reach")
        within(self, "no_echo_reach", 0.0)

    def ends(self, scan: Scan, pose: Pose2) -> tuple[Array, Array, np.ndarray]:
        """The sensor (2,), the beams' ends (n, 2) in the world, and which of them are hits (n,)."""
        return _ends(scan.ranges, scan.directions, scan.hit, scan.no_echo, self.reach,
                     min(self.no_echo_reach, scan.max_range), scan.mount, pose)  # fmt: skip


class Tracer:
    """Follows beams through tiles. Its memory is kept from scan to scan, and blank between them."""

    def __init__(self) -> None:
        self._marks = np.zeros(0, np.uint8)

    def trace(self, tiles: Tiles, sensor: Array, ends: Array, hit: np.ndarray) -> Seen:
        """The cells that beams from `sensor` (2,) to `ends` (n, 2) cross (free) or end in (hit).

        Takes the tiles that it needs. A beam that is no hit frees its last cell too.
        """
        left, low, right, high = _box(sensor, ends)
        spare = AROUND * tiles.resolution
        tiles.cover((left - spare, low - spare), (right + spare, high + spare))
        origin, scale = np.array(tiles.origin), 1 / tiles.resolution
        col0 = math.floor((left - origin[0]) * scale) - SPARE
        row0 = math.floor((low - origin[1]) * scale) - SPARE
        col1 = math.floor((right - origin[0]) * scale) + SPARE
        row1 = math.floor((high - origin[1]) * scale) + SPARE
        bits = (col1 - col0).bit_length()
        size = (row1 - row0 + 1) << bits
        if size > len(self._marks):
            self._marks = np.zeros(size, np.uint8)
        cells, flags, taken = _trace(
            (sensor - origin) * scale - (col0, row0),
            (ends - origin) * scale - (col0, row0),
            hit,
            self._marks,
            bits,
            row0,
            col0,
            tiles.index,
            tiles.free,
            tiles.used,
        )
        if taken:
            tiles.take(tiles.used + max(taken - len(tiles.free), 0))
        return Seen(cells, flags, ends[hit])


@njit(cache=True)
def _ends(ranges, directions, hit, no_echo, reach, clear, mount, pose):
    c, s = np.cos(pose.theta), np.sin(pose.theta)
    x, y = pose.x + c * mount.x - s * mount.y, pose.y + s * mount.x + c * mount.y
    ends, hits = np.empty((len(ranges), 2)), np.empty(len(ranges), np.bool_)
    n = 0
    for k in range(len(ranges)):
        if hit[k] or no_echo[k]:
            length = min(ranges[k], reach) if hit[k] else clear
            ends[n, 0] = x + length * (c * directions[k, 0] - s * directions[k, 1])
            ends[n, 1] = y + length * (s * directions[k, 0] + c * directions[k, 1])
            hits[n] = hit[k] and ranges[k] <= reach
            n += 1
    return np.array([x, y]), ends[:n], hits[:n]


@njit(cache=True)
def _box(sensor, ends):
    """Left, low, right and high border of a sensor and the ends of its beams."""
    left, low = sensor[0], sensor[1]
    right, high = left, low
    for k in range(len(ends)):
        left, right = min(left, ends[k, 0]), max(right, ends[k, 0])
        low, high = min(low, ends[k, 1]), max(high, ends[k, 1])
    return left, low, right, high


@njit(cache=True)
def _trace(sensor, ends, hit, marks, bits, row0, col0, index, free, used):
    """Follow every beam, in units of cells from the corner of a window, whose marks are left blank.

    Gives the cells, which are hit, and how many slots were entered into `index`.

    bits        the window has 1 << bits columns
    row0, col0  of its corner in the tiles
    """
    most = 1
    for k in range(len(ends)):
        most += abs(int(ends[k, 0]) - int(sensor[0])) + abs(int(ends[k, 1]) - int(sensor[1])) + 1
    visited = np.empty(most, np.int32)
    n = np.uint64(0)
    for k in range(len(ends)):
        n = _follow(marks, bits, sensor[0], sensor[1], ends[k, 0], ends[k, 1], hit[k], visited, n)
    cells, flags = np.empty(n, np.int64), np.empty(n, np.bool_)
    taken = 0
    for k in range(n):
        place = np.uint64(visited[k])
        row, col = (visited[k] >> bits) + row0, (visited[k] & ((1 << bits) - 1)) + col0
        slot = index[row >> SHIFT, col >> SHIFT]
        if slot == 0:
            slot = index[row >> SHIFT, col >> SHIFT] = slot_to_take(free, used, taken)
            taken += 1
        cells[k] = (slot << (2 * SHIFT)) + ((row & MASK) << SHIFT) + (col & MASK)
        flags[k] = marks[place] & HIT != 0
        marks[place] = 0
        if flags[k]:
            for r in ((row - MARGIN) >> SHIFT, (row + MARGIN) >> SHIFT):
                for c in ((col - MARGIN) >> SHIFT, (col + MARGIN) >> SHIFT):
                    if index[r, c] == 0:
                        index[r, c] = slot_to_take(free, used, taken)
                        taken += 1
    return cells, flags, taken


@njit(cache=True)
def _follow(marks, bits, x0, y0, x1, y1, hit, visited, n):
    """One beam (Amanatides and Woo 1987): notes the cells that are new, gives how many there are.

    It takes as many steps as there are borders between its ends; a rounding error may take one of
    them aside, by a cell at most, for which the window has room.
    """
    col, row = int(x0), int(y0)
    end_col, end_row = int(x1), int(y1)
    dx, dy = x1 - x0, y1 - y0
    along = np.uint64(1 if dx > 0 else -1)  # unsigned, so that no index is checked for its sign
    across = np.uint64((1 if dy > 0 else -1) << bits)
    delta_x = abs(1.0 / dx) if dx != 0 else NEVER
    delta_y = abs(1.0 / dy) if dy != 0 else NEVER
    next_x = (col + (dx > 0) - x0) / dx if dx != 0 else NEVER
    next_y = (row + (dy > 0) - y0) / dy if dy != 0 else NEVER
    place, end = np.uint64((row << bits) + col), np.uint64((end_row << bits) + end_col)
    for _ in range(abs(end_col - col) + abs(end_row - row)):
        visited[n] = place
        n += np.uint64(marks[place] == 0)
        marks[place] |= FREE
        x_first = next_x < next_y
        place += along if x_first else across
        next_x += delta_x if x_first else 0.0
        next_y += 0.0 if x_first else delta_y
    visited[n] = end
    n += np.uint64(marks[end] == 0)
    marks[end] |= HIT if hit else FREE
    return n
