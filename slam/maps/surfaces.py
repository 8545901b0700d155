"""Surfaces: per cell the lines and points that its echoes lie on, finer than its occupancy."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Pose2
from slam.grid import TILE
from slam.kernel import kernel
from slam.maps.outline import LINE, NOTHING, Outline
from slam.maps.tiles import AREA, MASK, SHIFT, Tiles

NONE = 0  # number of no surface; the first row of the table is not used
MAX_ECHOES = 50  # effective length of the running means, so that they follow what moved
SAME = 0.92  # cosine of the angle between two tangents, above which they are one surface's
INITIAL_ROWS = 1024  # of the table
COLUMNS = X, Y, TX, TY, ALONG, ACROSS, COUNT = range(7)  # of the table


class Surfaces:
    """What the echoes in every cell lie on: lines of different directions, and points.

    A surface is the running mean of its echoes and of their tangents. It belongs to the cell of its
    echoes; a cell at a corner has two. Which surfaces still stand is not stored: that is h, of the
    cells.

    first    layer, int32, number of the first surface of a cell
    table    (n, 7) mean x and y, m, world; unit vector along it, zero for a point; mean cosine and
             sine of twice the tangents' angle, zero for a point; number of echoes, up to MAX_ECHOES
    next     (n,) int32 number of the next surface of the same cell
    nbytes   of all of them
    """

    def __init__(self, tiles: Tiles):
        self.tiles = tiles
        self.first = tiles.layer(np.int32, NONE)
        self.table = np.zeros((INITIAL_ROWS, len(COLUMNS)))
        self.next = np.zeros(INITIAL_ROWS, np.int32)
        self._used = 1

    @property
    def nbytes(self) -> int:
        """Bytes of the table; the layer is one of the tiles'."""
        return self.table.nbytes + self.next.nbytes

    def add(self, outline: Outline, pose: Pose2) -> None:
        """Add the echoes of a scan taken at `pose`; those in no allocated tile are ignored."""
        self._reserve(len(outline.points))
        tiles = self.tiles
        self._used = _add(*outline, tuple(pose), tiles.index, *tiles.origin,
                          1 / tiles.resolution, self.first.flat, self.table, self.next,
                          self._used)  # fmt: skip

    def _reserve(self, rows: int) -> None:
        """Make room for so many more surfaces."""
        if self._used + rows > len(self.table):
            size = max(2 * len(self.table), self._used + rows)
            table, following = np.zeros((size, len(COLUMNS))), np.zeros(size, np.int32)
            table[: self._used] = self.table[: self._used]
            following[: self._used] = self.next[: self._used]
            self.table, self.next = table, following


@kernel
def _add(points, tangents, kind, pose, index, left, low, scale, first, table, following, used):
    c, s = np.cos(pose[2]), np.sin(pose[2])
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    for k in range(len(points)):
        x = pose[0] + c * points[k, 0] - s * points[k, 1]
        y = pose[1] + s * points[k, 0] + c * points[k, 1]
        i, j = int(np.floor((y - low) * scale)), int(np.floor((x - left) * scale))
        if kind[k] == NOTHING or not (0 <= i < rows and 0 <= j < cols):
            continue
        slot = index[i >> SHIFT, j >> SHIFT]
        if slot == 0:
            continue
        tx, ty = c * tangents[k, 0] - s * tangents[k, 1], s * tangents[k, 0] + c * tangents[k, 1]
        cell = slot * AREA + (i & MASK) * TILE + (j & MASK)
        row = _surface(first[cell], tx, ty, kind[k] == LINE, table, following)
        if row == NONE:
            row, used = used, used + 1
            table[row] = 0.0
            following[row], first[cell] = first[cell], row
        _average(table[row], x, y, tx, ty)
    return used


@kernel
def _surface(row, tx, ty, line, table, following):
    """The surface of a cell, from its first one on, that has a tangent; the point, if no `line`."""
    best, closest = NONE, SAME
    while row != NONE:
        if table[row, TX] == 0.0 and table[row, TY] == 0.0:
            if not line:
                return row
        elif line and abs(tx * table[row, TX] + ty * table[row, TY]) > closest:
            best, closest = row, abs(tx * table[row, TX] + ty * table[row, TY])
        row = following[row]
    return best


@kernel
def _average(surface, x, y, tx, ty):
    """Take an echo into the running means."""
    n = min(surface[COUNT] + 1.0, MAX_ECHOES)
    surface[COUNT] = n
    surface[X] += (x - surface[X]) / n
    surface[Y] += (y - surface[Y]) / n
    surface[ALONG] += (tx * tx - ty * ty - surface[ALONG]) / n
    surface[ACROSS] += (2.0 * tx * ty - surface[ACROSS]) / n
    length = math.hypot(surface[ALONG], surface[ACROSS])
    if length > 0.0:
        c = surface[ALONG] / length
        surface[TX] = math.sqrt(max(0.5 * (1.0 + c), 0.0))
        surface[TY] = math.copysign(math.sqrt(max(0.5 * (1.0 - c), 0.0)), surface[ACROSS])
