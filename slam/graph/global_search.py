"""Scan matching in a window several metres wide, by branch and bound (Hess et al. 2016)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slam.geometry import Array, Pose2, wrap_angle
from slam.kernel import kernel
from slam.maps.tiles import TILE, Tiles
from slam.sensor_models.endpoint import Endpoint

CANDIDATE_CELL = 2  # cells of the map between neighbouring candidates
KNOWN_CELL = 4  # the same, where the place is known
BOUND_LEVELS = 6  # squares of side 1, 2, 4, ... 32 candidates share a bound
TURN_STEP = math.radians(0.5)  # between candidates
MAX_POINTS = 150  # maximum number matched; evenly subsampled
OTHER_DISTANCE = 0.5  # m, OTHER_TURN in rad: two poses farther apart are different places
OTHER_TURN = math.radians(20.0)
CHUNK = 16  # points after which a sum is compared with the best one
ANYWHERE = np.empty((0, 0, 0), np.bool_)


class GlobalSearch:
    """A map prepared for the search: maxima of its field over squares of 1, 2, 4, ... cells.

    centre, reach  a pose, and (3,) m, m, rad around it, that hold all poses in the map

    The field is that of an `Endpoint`; the cells here are two or four times as wide, each with
    the maximum of the field in it.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        region: tuple[Array, Array] | None = None,
        known: bool = False,
    ):
        """Prepare the map, or only the part between two corners (2,), m, of a region.

        known  whether the place is known: the robot stands where the map is free, and unknown cells
               explain no echo
        """
        tiles, self._pad = endpoint.tiles, 1 << (BOUND_LEVELS - 1)
        fill = np.float32(endpoint.unknown)
        self._unknown = np.float32(endpoint.nothing) if known else fill
        side = tiles.resolution * TILE
        first, last = _tiles(tiles, region)
        index = np.ascontiguousarray(tiles.index[first[1] : last[1], first[0] : last[0]])
        width, values = KNOWN_CELL if known else CANDIDATE_CELL, endpoint.field().values
        coarse = _coarse(index, values, width, self._pad, (fill, self._unknown))
        self._maxima = _maxima(coarse, BOUND_LEVELS, self._unknown)
        self._top = max(self._maxima[-1].max(), self._unknown)
        self._standing = ANYWHERE
        if known:
            free = _coarse(index, values, width, self._pad, (fill, fill)) < endpoint.free
            self._standing = _any(free, BOUND_LEVELS)
        self._origin = np.array(tiles.origin) + first * side
        self._cell = width * tiles.resolution
        self.centre = Pose2.of([*(self._origin + (last - first) * side / 2), 0.0])
        self.reach = np.array([*((last - first) * side / 2), math.pi])

    @property
    def nbytes(self) -> int:
        """Bytes of the maxima."""
        return self._maxima.nbytes

    def best(
        self, points: Array, around: Pose2, reach: Array, but: Sequence[Pose2] = ()
    ) -> Pose2:
        """The pose within `reach` (3,), m and rad, of `around` at which `points` (n, 2), in the
        robot's frame, have the largest sum of the field.

        but  poses around which, within OTHER_DISTANCE and OTHER_TURN, none is considered
        """
        found = self.candidates(points, around, reach, but)
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
    ) -> list[Pose2]:
        """The best poses as of `best`, at most so many, each a place of its own, the best one
        first; those with a mean of the field above `least`.

        turn_step  rad between candidates
        """
        n = max(math.ceil(reach[2] / turn_step), 0)
        turns = np.array(sorted(range(-n, n + 1), key=abs)) * turn_step + around.theta
        window = np.ceil(reach[:2] / self._cell).astype(np.int64)
        every = np.linspace(0, len(points) - 1, min(len(points), MAX_POINTS)).astype(np.int64)
        middle = (np.array(around[:2]) - self._origin) / self._cell + self._pad
        excluded = self._excluded(turns, around, but)
        apart = (OTHER_DISTANCE / self._cell) ** 2, OTHER_TURN
        found = _search(
            self._maxima, self._standing, points[every] / self._cell, turns, middle, window,
            excluded, (self._unknown, self._top), np.float32(least * len(every)), apart, most,
        )  # fmt: skip
        xy = np.array(around[:2]) + found[:, :0:-1] * self._cell
        angles = [math.remainder(turn, math.tau) for turn in turns[found[:, 0]]]
        return [Pose2(x, y, angle) for (x, y), angle in zip(xy.tolist(), angles, strict=True)]

    def _excluded(
        self, turns: Array, around: Pose2, but: Sequence[Pose2]
    ) -> tuple[Array, Array]:
        """(turns, n) squared radii, in candidates, of the circles excluded at each turn, -1 where
        there is none; (n, 2) their centres."""
        poses = np.array(but).reshape(-1, 3)
        near = np.abs(wrap_angle(turns[:, None] - poses[:, 2])) <= OTHER_TURN
        radii = np.where(near, (OTHER_DISTANCE / self._cell) ** 2, -1.0)
        return radii, (poses[:, :2] - around[:2]) / self._cell


def _tiles(tiles: Tiles, region: tuple[Array, Array] | None) -> tuple[np.ndarray, np.ndarray]:
    """(2,) columns and rows of the first tile of a region, and of the one after the last."""
    shape = np.array(tiles.index.shape[::-1])
    if region is None:
        return np.zeros(2, np.int64), shape
    low, high = (np.array(region) - tiles.origin) / (tiles.resolution * TILE)
    first = np.clip(np.floor(low).astype(np.int64), 0, shape - 1)
    return first, np.clip(np.ceil(high).astype(np.int64), first + 1, shape)


@kernel
def _coarse(index, field, width, pad, fill):
    """The field in cells `width` times as wide, each with the maximum of the field in it,
    padded by `pad` unknown cells. `fill`: of unknown cells, the value in the field and here."""
    given, unknown = fill
    side = TILE // width
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
                    top = np.float32(-np.inf)
                    for k in range(width * width):
                        value = tile[(width * r + k // width) * TILE + width * c + k % width]
                        value = unknown if value == given else value
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


def _any(cells: np.ndarray, levels: int) -> np.ndarray:
    """(levels, rows, cols) whether one of the 1 << level cells up and right of each is true."""
    result = [cells]
    for level in range(1, levels):
        step, last = 1 << (level - 1), result[-1]
        wide = last.copy()
        wide[:, :-step] |= last[:, step:]
        high = wide.copy()
        high[:-step] |= wide[step:]
        result.append(high)
    return np.array(result)


@kernel
def _larger(a, b, result):
    for k in range(len(result)):
        result[k] = a[k] if a[k] > b[k] else b[k]


@kernel
def _search(
    maxima, standing, points, turns, middle, window, excluded, limits, least, apart, most
):
    """(n, 3) indices of turn, row and column of the best candidates above `least`, depth first,
    best node first. `limits`: the field of unknown cells, and its maximum. `apart`: squared
    distance, and rad, within which only the best one counts."""
    levels = len(maxima)
    beams = _beams(points, turns, middle, maxima.shape[2])
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
                if not _stands(standing, levels - 1, middle, nodes[m, 1], nodes[m, 2]):
                    continue
                bounds[m] = _sum(maxima[levels - 1], beams, t, nodes[m, 1], nodes[m, 2], limits,
                                 least)  # fmt: skip
                m += 1
    order = np.argsort(-bounds[:m], kind="mergesort")
    found, values = np.zeros((most, 3), np.int64), np.full(most, least, np.float32)
    best = least
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
                if _is_excluded(excluded, t, i, j):
                    continue
                best = _keep(found, values, turns, stack[depth, 1:], tops[depth], apart, least)
                continue
            half = 1 << (level - 1)
            for q in range(4):
                a, b = i + half * (q // 2), j + half * (q % 2)
                four[q] = -np.inf
                within = a <= window[1] and b <= window[0]
                if within and _stands(standing, level - 1, middle, a, b):
                    four[q] = _sum(maxima[level - 1], beams, t, a, b, limits, best)
            for _ in range(4):  # the best one last: it is taken first
                q = np.argmin(four)
                bound, four[q] = four[q], np.inf
                if bound > best:
                    stack[depth, 0], stack[depth, 1] = level - 1, t
                    stack[depth, 2] = i + half * (q // 2)
                    stack[depth, 3] = j + half * (q % 2)
                    tops[depth] = bound
                    depth += 1
    order = np.argsort(-values, kind="mergesort")
    return found[order[: (values > least).sum()]]


@kernel
def _keep(found, values, turns, candidate, value, apart, least):
    """Replace the worst candidate that was found, or one of the same place; returns the value that
    another one must exceed."""
    distance, angle = apart
    slot = np.argmin(values)
    for k in range(len(values)):
        if values[k] <= least:
            continue
        turn = abs(turns[candidate[0]] - turns[found[k, 0]])
        row, col = candidate[1] - found[k, 1], candidate[2] - found[k, 2]
        if row**2 + col**2 <= distance and min(turn, abs(2.0 * np.pi - turn)) <= angle:
            slot = k
            break
    if value > values[slot]:
        found[slot], values[slot] = candidate, value
    return values.min()


@kernel
def _is_excluded(excluded, t, i, j):
    """Whether row i and column j of the window lie in one of the circles."""
    radii, centres = excluded
    for k in range(len(centres)):
        if (j - centres[k, 0]) ** 2 + (i - centres[k, 1]) ** 2 <= radii[t, k]:
            return True
    return False


@kernel
def _stands(standing, level, middle, i, j):
    """Whether the robot may stand in one of the cells from row i and column j of the window on."""
    if not len(standing):
        return True
    r, c = int(np.floor(middle[1])) + i, int(np.floor(middle[0])) + j
    _, high, wide = standing.shape
    return 0 <= r < high and 0 <= c < wide and standing[level, r, c]


@kernel
def _beams(points, turns, middle, wide):
    """(turns, n) rows and columns of the points' cells, (turns, 4) their least and largest, and
    (turns, n) their places in an array of that many columns."""
    rows = np.empty((len(turns), len(points)), np.int64)
    cols, box = rows.copy(), np.zeros((len(turns), 4), np.int64)
    for t in range(len(turns)):
        c, s = np.cos(turns[t]), np.sin(turns[t])
        for k in range(len(points)):
            cols[t, k] = int(np.floor(middle[0] + c * points[k, 0] - s * points[k, 1]))
            rows[t, k] = int(np.floor(middle[1] + s * points[k, 0] + c * points[k, 1]))
        if len(points):
            box[t, 0], box[t, 1] = rows[t].min(), rows[t].max()
            box[t, 2], box[t, 3] = cols[t].min(), cols[t].max()
    return rows, cols, box, (rows * wide + cols).astype(np.uint64)


@kernel
def _sum(maxima, beams, t, i, j, limits, least):
    """The sum of the maxima at the points, or -inf as soon as it cannot exceed `least`."""
    rows, cols, box, places = beams
    high, wide = maxima.shape
    inside = box[t, 0] + i >= 0 and box[t, 1] + i < high
    inside = inside and box[t, 2] + j >= 0 and box[t, 3] + j < wide
    unknown, top = limits
    total, n = np.float32(0.0), rows.shape[1]
    flat, shift = maxima.ravel(), np.uint64(i * wide + j)
    for begin in range(0, n, CHUNK):
        end = min(begin + CHUNK, n)
        if inside:
            for k in range(begin, end):
                total += flat[places[t, k] + shift]
        else:
            for k in range(begin, end):
                r, c = rows[t, k] + i, cols[t, k] + j
                known = 0 <= r < high and 0 <= c < wide
                total += maxima[r, c] if known else unknown
        if total + np.float32(n - end) * top <= least:
            return np.float32(-np.inf)
    return total
