"""Scan matching in a window several metres wide, by branch and bound (Hess et al. 2016)."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Array, Pose2, wrap_angle
from slam.kernel import kernel
from slam.maps.tiles import TILE, Tiles
from slam.sensor_models.endpoint import Endpoint

CANDIDATE_CELL = 2  # cells of the map between neighbouring candidates
BOUND_LEVELS = 6  # squares of side 1, 2, 4, ... 32 candidates share a bound
TURN_STEP = math.radians(0.5)  # between candidates
MAX_POINTS = 150  # maximum number matched; evenly subsampled
OTHER_DISTANCE = 0.5  # m, OTHER_TURN in rad: two poses farther apart are different places
OTHER_TURN = math.radians(20.0)


class GlobalSearch:
    """A map prepared for the search: maxima of its field over squares of 1, 2, 4, ... cells.

    centre, reach  a pose, and (3,) m, m, rad around it, that hold all poses in the map

    The field is that of an `Endpoint`; the cells here are CANDIDATE_CELL times as wide, each with
    the maximum of the field in it.
    """

    def __init__(self, endpoint: Endpoint, region: tuple[Array, Array] | None = None):
        """Prepare the map, or only the part between two corners (2,), m, of a region."""
        tiles, self._pad = endpoint.tiles, 1 << (BOUND_LEVELS - 1)
        self._unknown = np.float32(endpoint.unknown)
        side = tiles.resolution * TILE
        first, last = _tiles(tiles, region)
        index = np.ascontiguousarray(tiles.index[first[1] : last[1], first[0] : last[0]])
        coarse = _coarse(index, endpoint.field().values, self._pad, self._unknown)
        self._maxima = _maxima(coarse, BOUND_LEVELS, self._unknown)
        self._origin = np.array(tiles.origin) + first * side
        self._cell = CANDIDATE_CELL * tiles.resolution
        self.centre = Pose2.of([*(self._origin + (last - first) * side / 2), 0.0])
        self.reach = np.array([*((last - first) * side / 2), math.pi])

    @property
    def nbytes(self) -> int:
        """Bytes of the maxima."""
        return self._maxima.nbytes

    def best(self, points: Array, around: Pose2, reach: Array, but: Pose2 | None = None) -> Pose2:
        """The pose within `reach` (3,), m and rad, of `around` at which `points` (n, 2), in the
        robot's frame, have the largest sum of the field.

        but  a pose around which, within OTHER_DISTANCE and OTHER_TURN, none is considered
        """
        pose = self.better(points, around, reach, but, TURN_STEP)
        return around if pose is None else pose  # None: there are no points

    def better(
        self,
        points: Array,
        around: Pose2,
        reach: Array,
        but: Pose2 | None = None,
        turn_step: float = TURN_STEP,
        least: float = -math.inf,
    ) -> Pose2 | None:
        """As `best`, but None if there is no pose with a mean of the field above `least`.

        turn_step  rad between candidates
        """
        n = max(math.ceil(reach[2] / turn_step), 0)
        turns = np.array(sorted(range(-n, n + 1), key=abs)) * turn_step + around.theta
        window = np.ceil(reach[:2] / self._cell).astype(np.int64)
        every = np.linspace(0, len(points) - 1, min(len(points), MAX_POINTS)).astype(np.int64)
        middle = (np.array(around[:2]) - self._origin) / self._cell + self._pad
        excluded = self._excluded(turns, around, but)
        turn, row, col = _search(
            self._maxima, points[every] / self._cell, turns, middle, window, excluded,
            self._unknown, np.float32(least * len(every)),
        )  # fmt: skip
        if turn < 0:
            return None
        x, y = around.x + col * self._cell, around.y + row * self._cell
        return Pose2(x, y, math.remainder(turns[turn], math.tau))

    def _excluded(self, turns: Array, around: Pose2, but: Pose2 | None) -> tuple[Array, Array]:
        """(turns,) squared radii, in candidates, of the circle excluded at each turn, -1 where
        there is none; (2,) its centre."""
        radii, centre = np.full(len(turns), -1.0), np.zeros(2)
        if but is not None:
            centre[:] = (but.x - around.x) / self._cell, (but.y - around.y) / self._cell
            near = np.abs(wrap_angle(turns - but.theta)) <= OTHER_TURN
            radii[near] = (OTHER_DISTANCE / self._cell) ** 2
        return radii, centre


def _tiles(tiles: Tiles, region: tuple[Array, Array] | None) -> tuple[np.ndarray, np.ndarray]:
    """(2,) columns and rows of the first tile of a region, and of the one after the last."""
    shape = np.array(tiles.index.shape[::-1])
    if region is None:
        return np.zeros(2, np.int64), shape
    low, high = (np.array(region) - tiles.origin) / (tiles.resolution * TILE)
    first = np.clip(np.floor(low).astype(np.int64), 0, shape - 1)
    return first, np.clip(np.ceil(high).astype(np.int64), first + 1, shape)


@kernel
def _coarse(index, field, pad, unknown):
    """The field in cells CANDIDATE_CELL times as wide, each with the maximum of the field in it,
    padded with `unknown` by `pad` cells."""
    side = TILE // CANDIDATE_CELL
    high, wide = index.shape
    result = np.full((high * side + 2 * pad, wide * side + 2 * pad), unknown, np.float32)
    for i in range(high):
        for j in range(wide):
            if index[i, j] == 0:
                continue
            tile = field[index[i, j]]
            for r in range(side):
                row = result[pad + i * side + r, pad + j * side :]
                for c in range(side):
                    top = tile[CANDIDATE_CELL * r * TILE + CANDIDATE_CELL * c]
                    for k in range(CANDIDATE_CELL * CANDIDATE_CELL):
                        value = tile[
                            (CANDIDATE_CELL * r + k // CANDIDATE_CELL) * TILE
                            + CANDIDATE_CELL * c
                            + k % CANDIDATE_CELL
                        ]
                        top = value if value > top else top
                    row[c] = top
    return result


@kernel
def _maxima(field, levels, unknown):
    """(levels, rows, cols) the maximum over the square of 1 << level cells up and right of each."""
    rows, cols = field.shape
    result = np.empty((levels, rows, cols), np.float32)
    result[0] = field
    wide = np.full((rows, cols), unknown, np.float32)
    for level in range(1, levels):
        step = 1 << (level - 1)
        for r in range(rows):
            _larger(result[level - 1, r, :-step], result[level - 1, r, step:], wide[r, :-step])
            for c in range(cols - step, cols):
                wide[r, c] = max(result[level - 1, r, c], unknown)
        for r in range(rows - step):
            _larger(wide[r], wide[r + step], result[level, r])
        for r in range(rows - step, rows):
            for c in range(cols):
                result[level, r, c] = max(wide[r, c], unknown)
    return result


@kernel
def _larger(a, b, result):
    for k in range(len(result)):
        result[k] = a[k] if a[k] > b[k] else b[k]


@kernel
def _search(maxima, points, turns, middle, window, excluded, unknown, least):
    """Indices of turn, row and column of the best candidate above `least`, -1 if there is none;
    depth first, best node first."""
    radii, centre = excluded
    levels, n = len(maxima), len(points)
    rows, cols = np.empty((len(turns), n), np.int32), np.empty((len(turns), n), np.int32)
    for t in range(len(turns)):
        c, s = np.cos(turns[t]), np.sin(turns[t])
        for k in range(n):
            cols[t, k] = int(np.floor(middle[0] + c * points[k, 0] - s * points[k, 1]))
            rows[t, k] = int(np.floor(middle[1] + s * points[k, 0] + c * points[k, 1]))
    side = 1 << (levels - 1)
    wide, high = (2 * window[0]) // side + 1, (2 * window[1]) // side + 1
    nodes = np.empty((len(turns) * wide * high, 3), np.int64)
    bounds = np.empty(len(nodes), np.float32)
    m = 0
    for t in range(len(turns)):
        for i in range(high):
            for j in range(wide):
                nodes[m, 0] = t
                nodes[m, 1], nodes[m, 2] = i * side - window[1], j * side - window[0]
                bounds[m] = _sum(maxima[levels - 1], rows[t], cols[t], nodes[m, 1], nodes[m, 2],
                                 unknown)  # fmt: skip
                m += 1
    order = np.argsort(-bounds, kind="mergesort")
    best, place = least, np.full(3, -1, np.int64)
    stack, tops = np.empty((4 * levels, 4), np.int64), np.empty(4 * levels, np.float32)
    four = np.empty(4, np.float32)
    for o in order:
        if bounds[o] <= best:
            break
        stack[0, 0], stack[0, 1:], tops[0] = levels - 1, nodes[o], bounds[o]
        depth = 1
        while depth:
            depth -= 1
            level, t, i, j = stack[depth]
            if tops[depth] <= best:
                continue
            if level == 0:
                if (j - centre[0]) ** 2 + (i - centre[1]) ** 2 <= radii[t]:
                    continue
                best = tops[depth]
                place[0], place[1], place[2] = t, i, j
                continue
            half = 1 << (level - 1)
            for q in range(4):
                a, b = i + half * (q // 2), j + half * (q % 2)
                four[q] = -np.inf
                if a <= window[1] and b <= window[0]:
                    four[q] = _sum(maxima[level - 1], rows[t], cols[t], a, b, unknown)
            for q in np.argsort(four):
                if four[q] > best:
                    stack[depth, 0], stack[depth, 1] = level - 1, t
                    stack[depth, 2] = i + half * (q // 2)
                    stack[depth, 3] = j + half * (q % 2)
                    tops[depth] = four[q]
                    depth += 1
    return place[0], place[1], place[2]


@kernel
def _sum(maxima, rows, cols, i, j, unknown):
    high, wide = maxima.shape
    total = np.float32(0.0)
    for k in range(len(rows)):
        r, c = rows[k] + i, cols[k] + j
        inside = 0 <= r < high and 0 <= c < wide
        total += maxima[r, c] if inside else unknown
    return total
