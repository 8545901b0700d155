"""Scan matching in a window several metres wide, by branch and bound (Hess et al. 2016)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slam.geometry import Array, Pose2, wrap_angle
from slam.graph.branch_and_bound import (
    HALF_LANE,
    LANE,
    MARGIN,
    SQUARE,
    best_candidates,
)
from slam.graph.kept_places import OTHER_TURN
from slam.kernel import kernel
from slam.maps.tiles import TILE, Tiles
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.pyramid import MAX_UNITS, in_units, scale_of

CANDIDATE_CELL = 2  # cells of the map between neighbouring candidates
KNOWN_CELL = 4  # the same, where the place is known
TURN_STEP = math.radians(0.5)  # between candidates
MAX_POINTS = 150  # maximum number matched; evenly subsampled: the largest sum is below 1 << LANE
OTHER_DISTANCE = 0.5  # m, and OTHER_TURN: two poses farther apart are different places
ROUNDING = 1e-6  # of a unit
ANYWHERE = np.empty((0, 0, 0), np.bool_)


class GlobalSearch:
    """A map prepared for the search: its field, and the maxima of it over squares of cells.

    centre, reach  a pose, and (3,) m, m, rad around it, that hold all poses in the map

    The field is that of an `Endpoint`; the cells here are two or four times as wide, each with the
    maximum of the field in it, rounded up to 1/255 of the field's span.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        region: tuple[Array, Array] | None = None,
        known: bool = False,
        widened: bool = False,
    ):
        """Prepare the map, or only the part between two corners (2,), m, of a region.

        known    whether the place is known: the robot stands where the map is free, and unknown
                 cells explain no echo
        widened  each cell has the maximum over its neighbours, too: a wall that lies between two
                 candidates counts for both. Few places are missed, and more are found that are none
        """
        tiles, self._pad = endpoint.tiles, SQUARE
        self._low, self._unit = endpoint.nothing, (endpoint.top - endpoint.nothing) / MAX_UNITS
        unknown, free = (self._units(value) for value in (endpoint.unknown, endpoint.free))
        self._unknown = 0 if known else unknown
        side = tiles.resolution * TILE
        first, last = _tiles(tiles, region)
        index = np.ascontiguousarray(tiles.index[first[1] : last[1], first[0] : last[0]])
        width, self._standing = CANDIDATE_CELL, ANYWHERE
        if known:
            width, scale = KNOWN_CELL, scale_of(self._low, endpoint.top)
            cells, every = _coarse(index, endpoint.field().values, width, self._pad,
                                   np.float32(endpoint.unknown), unknown, scale)  # fmt: skip
            self._standing = _squares(every < free)
        else:
            cells = _side_by_side(index, endpoint.maxima.values, self._pad, unknown)
        cells = _widened(cells) if widened else cells
        self._words = _words(cells, self._unknown)
        self._phases = _phases(_square_maxima(cells, self._unknown), self._unknown)
        self._origin = np.array(tiles.origin) + first * side
        self._cell = width * tiles.resolution
        self.centre = Pose2.of([*(self._origin + (last - first) * side / 2), 0.0])
        self.reach = np.array([*((last - first) * side / 2), math.pi])

    def _units(self, value: float) -> int:
        """A value of the field in 1/255 of its span, rounded up."""
        return math.ceil((value - self._low) / self._unit - ROUNDING)

    @property
    def nbytes(self) -> int:
        """Bytes of the field and of the maxima."""
        return self._words.nbytes + self._phases.nbytes

    def best(
        self,
        points: Array,
        around: Pose2,
        reach: Array,
        but: Sequence[Pose2] = (),
        turn_step: float = TURN_STEP,
    ) -> Pose2:
        """The pose within `reach` (3,), m and rad, of `around` at which `points` (n, 2), in the
        robot's frame, have the largest sum of the field.

        but        poses around which, within OTHER_DISTANCE and OTHER_TURN, none is considered
        turn_step  rad between candidates
        """
        found = self.candidates(points, around, reach, but, turn_step)
        return found[0] if found else around  # there are no points

    def candidates(
        self,
        points: Array,
        around: Pose2,
        reach: Array,
        but: Sequence[Pose2] = (),
        turn_step: float = TURN_STEP,
        least: float = -math.inf,
        most: int = 1,
        apart: float = OTHER_DISTANCE,
    ) -> list[Pose2]:
        """The best poses as of `best`, at most so many, each `apart`, m, or OTHER_TURN from better
        ones, the best one first; those with a mean of the field above `least`."""
        n = max(math.ceil(reach[2] / turn_step), 0)
        turns = _inside_out(n) * turn_step + around.theta
        window = np.ceil(reach[:2] / self._cell).astype(np.int64)
        if len(points) > MAX_POINTS:
            points = points[np.linspace(0, len(points) - 1, MAX_POINTS).astype(np.int64)]
        middle = (np.array(around[:2]) - self._origin) / self._cell + self._pad
        least_units = max((least - self._low) / self._unit, -1.0)
        found = best_candidates(
            self._words, self._phases, self._standing, points / self._cell, turns, middle,
            window, self._excluded(turns, around, but), self._unknown,
            max(math.floor(least_units * len(points)), 0), (apart / self._cell) ** 2, most,
        )  # fmt: skip
        xy = np.array(around[:2]) + found[:, :0:-1] * self._cell
        angles = [math.remainder(turn, math.tau) for turn in turns[found[:, 0]]]
        return [Pose2(x, y, angle) for (x, y), angle in zip(xy.tolist(), angles, strict=True)]

    def _excluded(self, turns: Array, around: Pose2, but: Sequence[Pose2]) -> tuple[Array, Array]:
        """(turns, n) squared radii, in candidates, of the circles excluded at each turn, -1 where
        there is none; (n, 2) their centres."""
        if not but:
            return np.empty((len(turns), 0)), np.empty((0, 2))
        poses = np.array(but)
        near = np.abs(wrap_angle(turns[:, None] - poses[:, 2])) <= OTHER_TURN
        radii = np.where(near, (OTHER_DISTANCE / self._cell) ** 2, -1.0)
        return radii, (poses[:, :2] - around[:2]) / self._cell


def _inside_out(n: int) -> np.ndarray:
    """(2 n + 1,) 0, -1, 1, -2, 2, ... up to -n and n."""
    numbers = np.arange(1, 2 * n + 2) // 2
    numbers[1::2] *= -1
    return numbers


def _tiles(tiles: Tiles, region: tuple[Array, Array] | None) -> tuple[np.ndarray, np.ndarray]:
    """(2,) columns and rows of the first tile of a region, and of the one after the last."""
    shape = np.array(tiles.index.shape[::-1])
    if region is None:
        return np.zeros(2, np.int64), shape
    low, high = (np.array(region) - tiles.origin) / (tiles.resolution * TILE)
    first = np.clip(np.floor(low).astype(np.int64), 0, shape - 1)
    return first, np.clip(np.ceil(high).astype(np.int64), first + 1, shape)


@kernel
def _side_by_side(index, maxima, pad, fill):
    """(rows, cols) the maxima of all tiles, padded by `pad` cells of value `fill`, as are tiles
    that are not in use."""
    side = TILE // CANDIDATE_CELL
    shape = index.shape[0] * side + 2 * pad, index.shape[1] * side + 2 * pad
    cells = np.full(shape, fill, np.uint8)
    for i, j in np.ndindex(index.shape):
        slot = index[i, j]
        for r in range(side if slot else 0):
            row, col, begin = pad + i * side + r, pad + j * side, r * side
            cells[row, col : col + side] = maxima[slot, begin : begin + side]
    return cells


@kernel
def _coarse(index, field, width, pad, unknown, fill, scale):
    """The field in cells `width` times as wide, each with the maximum of the field in it, in units
    of its span, padded by `pad` unknown cells; first without the unknown cells, then with them.

    unknown  the field's value in unknown cells; `fill`: the same in units
    scale    see `in_units`
    """
    side = TILE // width
    shape = index.shape[0] * side + 2 * pad, index.shape[1] * side + 2 * pad
    every, known = np.full(shape, fill, np.uint8), np.zeros(shape, np.uint8)
    explaining, top = np.empty(TILE, np.float32), np.empty(TILE, np.float32)
    for i, j in np.ndindex(index.shape):
        slot = np.uint64(index[i, j])
        if slot == 0:
            continue
        for r in range(side):
            explaining[:] = top[:] = scale[0]
            for a in range(width):
                begin = np.uint64((width * r + a) * TILE)
                for k in range(TILE):
                    value = field[slot, begin + np.uint64(k)]
                    top[k] = value if value > top[k] else top[k]
                for k in range(TILE):
                    value = field[slot, begin + np.uint64(k)]
                    more = value > explaining[k] and value != unknown
                    explaining[k] = value if more else explaining[k]
            row, col = pad + i * side + r, pad + j * side
            _write_units(every[row, col : col + side], top, width, scale)
            _write_units(known[row, col : col + side], explaining, width, scale)
    return known, every


@kernel
def _write_units(cells, values, width, scale):
    """Write the maximum of each `width` values of the field, in units."""
    for c in range(len(cells)):
        most = values[np.uint64(c * width)]
        for k in range(1, width):
            most = max(most, values[np.uint64(c * width + k)])
        values[np.uint64(c)] = most
    for c in range(len(cells)):
        cells[c] = in_units(values[c], *scale)


def _widened(cells: np.ndarray) -> np.ndarray:
    """(rows, cols) the maximum over each cell and its eight neighbours."""
    row = cells.copy()
    np.maximum(row[:, 1:], cells[:, :-1], out=row[:, 1:])
    np.maximum(row[:, :-1], cells[:, 1:], out=row[:, :-1])
    result = row.copy()
    np.maximum(result[1:], row[:-1], out=result[1:])
    np.maximum(result[:-1], row[1:], out=result[:-1])
    return result


@kernel
def _words(cells, unknown):
    """(rows, MARGIN + cols) uint64: each holds SQUARE neighbouring cells of a row, in LANE bits
    each, so that one addition adds to SQUARE sums, and those of the row above in the upper halves
    of the lanes; those at the borders hold unknown cells too."""
    rows, cols = cells.shape
    words, row = np.empty((rows, MARGIN + cols), np.uint64), np.empty(2 * MARGIN + cols, np.uint64)
    row[:] = unknown | unknown << HALF_LANE
    for r in range(rows):
        for c in range(cols):
            above = cells[r + 1, c] if r + 1 < rows else unknown
            row[MARGIN + c] = np.uint64(cells[r, c]) | np.uint64(above) << np.uint64(HALF_LANE)
        for c in range(MARGIN + cols):
            word = np.uint64(0)
            for k in range(SQUARE):
                word |= row[c + k] << np.uint64(LANE * k)
            words[r, c] = word
    return words


@kernel
def _square_maxima(cells, unknown):
    """(rows, cols) the maximum over the square of SQUARE cells up and right of each."""
    rows, cols = cells.shape
    result, column = np.empty((rows, cols), np.uint8), np.full(cols + MARGIN, unknown, np.uint8)
    for r in range(rows):
        column[:cols] = cells[r]
        for k in range(r + 1, r + SQUARE):
            for c in range(cols):
                other = cells[np.uint64(k), np.uint64(c)] if k < rows else np.uint8(unknown)
                column[c] = max(column[c], other)
        for c in range(cols):  # SQUARE is 4
            left, right = max(column[c], column[c + 1]), max(column[c + 2], column[c + 3])
            result[r, c] = max(left, right)
    return result


def _squares(cells: np.ndarray) -> np.ndarray:
    """(2, rows, cols) the cells, and whether one of the square of SQUARE cells up and right of each
    is true."""
    result = np.array([cells, cells])
    for k in range(1, SQUARE):
        result[1, :, :-k] |= cells[:, k:]
    wide = result[1].copy()
    for k in range(1, SQUARE):
        result[1, :-k] |= wide[k:]
    return result


@kernel
def _phases(maxima, unknown):
    """(SQUARE, SQUARE, rows, cols) uint16 every SQUARE-th row and column of the maxima, from each
    of the first ones on, by how much they exceed unknown cells, modulo 2^16."""
    rows, cols = maxima.shape
    result = np.zeros((SQUARE, SQUARE, -(-rows // SQUARE), -(-cols // SQUARE)), np.uint16)
    for r in range(rows):
        for c in range(cols):
            excess = np.int64(maxima[r, c]) - unknown
            result[r % SQUARE, c % SQUARE, r // SQUARE, c // SQUARE] = np.uint16(excess)
    return result
