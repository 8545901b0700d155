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
BOUND_LEVELS = 3  # squares of side 1, 2 and 4 candidates share a bound
SQUARE = 1 << (BOUND_LEVELS - 1)  # candidates along the side of the largest ones
TURN_STEP = math.radians(0.5)  # between candidates
MAX_POINTS = 150  # maximum number matched; evenly subsampled
OTHER_DISTANCE = 0.5  # m, OTHER_TURN in rad: two poses farther apart are different places
OTHER_TURN = math.radians(20.0)
CHUNK = 8  # points after which a sum is compared with the best one
MAX_UNITS = 255  # of the field's span, uint8
NO_SUM = -1  # below any sum
ABOVE_ALL = np.iinfo(np.int64).max  # sums
ROUNDING = 1e-6  # of a unit
ANYWHERE = np.empty((0, 0, 0), np.bool_)


class GlobalSearch:
    """A map prepared for the search: maxima of its field over squares of 1, 2, 4, ... cells.

    centre, reach  a pose, and (3,) m, m, rad around it, that hold all poses in the map

    The field is that of an `Endpoint`; the cells here are two or four times as wide, each with the
    maximum of the field in it, rounded up to 1/255 of the field's span.
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
        self._low, self._unit = endpoint.nothing, (endpoint.top - endpoint.nothing) / MAX_UNITS
        unknown, free = (self._units(value) for value in (endpoint.unknown, endpoint.free))
        self._unknown = 0 if known else unknown
        side = tiles.resolution * TILE
        first, last = _tiles(tiles, region)
        index = np.ascontiguousarray(tiles.index[first[1] : last[1], first[0] : last[0]])
        width = KNOWN_CELL if known else CANDIDATE_CELL
        explaining, every = _coarse(index, endpoint.field().values, width, self._pad,
                                    np.float32(endpoint.unknown), unknown,
                                    np.float32(self._low), np.float32(1 / self._unit))  # fmt: skip
        self._maxima = _maxima(explaining if known else every, BOUND_LEVELS, self._unknown)
        self._phases = _phases(self._maxima[-1], self._unknown)
        self._top = max(int(self._maxima[-1].max()), self._unknown)
        self._standing = _any(every < free, BOUND_LEVELS) if known else ANYWHERE
        self._origin = np.array(tiles.origin) + first * side
        self._cell = width * tiles.resolution
        self.centre = Pose2.of([*(self._origin + (last - first) * side / 2), 0.0])
        self.reach = np.array([*((last - first) * side / 2), math.pi])

    def _units(self, value: float) -> int:
        """A value of the field in 1/255 of its span, rounded up."""
        return math.ceil((value - self._low) / self._unit - ROUNDING)

    @property
    def nbytes(self) -> int:
        """Bytes of the maxima."""
        return self._maxima.nbytes + self._phases.nbytes

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
    ) -> list[Pose2]:
        """The best poses as of `best`, at most so many, each a place of its own, the best one
        first; those with a mean of the field above `least`."""
        n = max(math.ceil(reach[2] / turn_step), 0)
        turns = np.array(sorted(range(-n, n + 1), key=abs)) * turn_step + around.theta
        window = np.ceil(reach[:2] / self._cell).astype(np.int64)
        every = np.linspace(0, len(points) - 1, min(len(points), MAX_POINTS)).astype(np.int64)
        middle = (np.array(around[:2]) - self._origin) / self._cell + self._pad
        least_units = max((least - self._low) / self._unit, -1.0)
        found = _search(
            self._maxima, self._phases, self._standing, points[every] / self._cell, turns, middle,
            window, self._excluded(turns, around, but), (self._unknown, self._top),
            max(math.floor(least_units * len(every)), 0), (OTHER_DISTANCE / self._cell) ** 2, most,
        )  # fmt: skip
        xy = np.array(around[:2]) + found[:, :0:-1] * self._cell
        angles = [math.remainder(turn, math.tau) for turn in turns[found[:, 0]]]
        return [Pose2(x, y, angle) for (x, y), angle in zip(xy.tolist(), angles, strict=True)]

    def _excluded(self, turns: Array, around: Pose2, but: Sequence[Pose2]) -> tuple[Array, Array]:
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
def _coarse(index, field, width, pad, unknown, fill, low, scale):
    """The field in cells `width` times as wide, each with the maximum of the field in it, in units
    of its span, padded by `pad` unknown cells; first without the unknown cells, then with them.

    unknown  the field's value in unknown cells; `fill`: the same in units
    low      the field's minimum; `scale`: units by value
    """
    side = TILE // width
    shape = index.shape[0] * side + 2 * pad, index.shape[1] * side + 2 * pad
    known, every = np.zeros(shape, np.uint8), np.full(shape, fill, np.uint8)
    top = np.empty((2, TILE), np.float32)
    for i, j in np.ndindex(index.shape):
        if index[i, j] == 0:
            continue
        for r in range(side):
            top[:] = low
            for k in range(width * r * TILE, width * (r + 1) * TILE, TILE):
                _raise(top, field[index[i, j], k : k + TILE], unknown)
            row, col = pad + i * side + r, pad + j * side
            _pool(top[0], width, low, scale, known[row, col : col + side])
            _pool(top[1], width, low, scale, every[row, col : col + side])
    return known, every


@kernel
def _raise(top, row, unknown):
    """Take a row of cells into the maxima (2, TILE) without the unknown cells, and with them."""
    for k in range(TILE):
        value = row[k]
        top[1, k] = max(top[1, k], value)
        top[0, k] = max(top[0, k], top[0, k] if value == unknown else value)


@kernel
def _pool(top, width, low, scale, result):
    """The maximum of every `width` values, in units, rounded up."""
    for c in range(len(result)):
        best = top[width * c]
        for k in range(width * c + 1, width * (c + 1)):
            best = max(best, top[k])
        result[c] = np.uint8(min(np.ceil((best - low) * scale), np.float32(MAX_UNITS)))


@kernel
def _maxima(field, levels, unknown):
    """(levels, rows, cols) the maximum over the square of 1 << level cells up and right of each."""
    rows, cols = field.shape
    result = np.empty((levels, rows, cols), np.uint8)
    result[0] = field
    wide = np.full((rows, cols), unknown, np.uint8)
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


def _phases(maxima: np.ndarray, unknown: int) -> np.ndarray:
    """(SQUARE, SQUARE, rows, cols) uint16 every SQUARE-th row and column of the maxima, from each
    of the first ones on, by how much they exceed unknown cells, modulo 2^16."""
    high, wide = (-(-n // SQUARE) for n in maxima.shape)
    result = np.zeros((SQUARE, SQUARE, high, wide), np.uint16)
    for i, j in np.ndindex(SQUARE, SQUARE):
        part = maxima[i::SQUARE, j::SQUARE]
        result[i, j, : len(part), : part.shape[1]] = part - np.uint16(unknown)
    return result


@kernel
def _search(
    maxima, phases, standing, points, turns, middle, window, excluded, limits, least, radius, most
):
    """(n, 3) turns, rows and columns of the best candidates above `least`, at most so many, the
    best one first; depth first, best node first.

    limits  the field of unknown cells, and its maximum
    radius  squared, of a place, of which only the best candidate counts
    """
    beams = _beams(points, turns, middle, maxima.shape[2])
    bounds = _bounds(phases, beams, window, limits[0])
    _stand(bounds, standing, middle, window)
    found, values = np.full((most, 3), -1), np.full(most, least)
    kept, node = (found, values, turns, radius, least), np.empty(3, np.int64)
    high, wide = bounds.shape[1:]
    flat = bounds.ravel()
    for first in (True, False):  # the most promising node, then those that may be better
        nodes = np.full(1, flat.argmax()) if first else np.flatnonzero(flat > values.min())
        for o in nodes[_descending(flat[nodes], len(points) * MAX_UNITS)]:
            if flat[o] <= values.min():
                break
            node[0] = o // (high * wide)
            node[1] = o // wide % high * SQUARE - window[1]
            node[2] = o % wide * SQUARE - window[0]
            _descend(maxima, standing, beams, middle, window, excluded, limits, node, kept)
    order = np.argsort(-values, kind="mergesort")
    return found[order[: (values > least).sum()]]


@kernel
def _keep(kept, turn, row, col, value):
    """Keep a candidate instead of the worst one, unless a better one is of the same place; worse
    ones of the same place are dropped."""
    found, values, turns, radius, least = kept
    for k in range(len(values)):
        if found[k, 0] < 0:
            continue
        apart = abs(turns[turn] - turns[found[k, 0]])
        near = (row - found[k, 1]) ** 2 + (col - found[k, 2]) ** 2 <= radius
        if near and min(apart, abs(2.0 * np.pi - apart)) <= OTHER_TURN:
            if values[k] >= value:
                return
            found[k, 0], values[k] = -1, least
    slot = np.argmin(values)
    if value > values[slot]:
        found[slot, 0], found[slot, 1], found[slot, 2], values[slot] = turn, row, col, value


@kernel
def _bounds(phases, beams, window, unknown):
    """(turns, rows, cols) uint16 the sums of the maxima over squares of SQUARE candidates."""
    rows, cols = beams[0], beams[1]
    high, wide = 2 * window[1] // SQUARE + 1, 2 * window[0] // SQUARE + 1
    bounds = np.full((len(rows), high, wide), rows.shape[1] * unknown, np.uint16)
    for t in range(len(rows)):
        for k in range(rows.shape[1]):
            row, col = rows[t, k] - window[1], cols[t, k] - window[0]
            phase = phases[row % SQUARE, col % SQUARE]
            _accumulate(bounds[t], phase, row // SQUARE, col // SQUARE)
    return bounds


@kernel
def _accumulate(sums, phase, row, col):
    """Add to sums (rows, cols) the part of a phase that begins at a row and a column."""
    begin = max(-col, 0)
    end = max(min(phase.shape[1] - col, sums.shape[1]), begin)  # a negative end would wrap around
    for a in range(max(-row, 0), min(len(phase) - row, len(sums))):
        target, source = sums[a, begin:end], phase[row + a, col + begin : col + end]
        for k in range(len(target)):
            target[k] += source[k]


@kernel
def _stand(bounds, standing, middle, window):
    """Set the bounds of squares to zero where no robot may stand."""
    for a in range(bounds.shape[1]):
        for b in range(bounds.shape[2]):
            i, j = a * SQUARE - window[1], b * SQUARE - window[0]
            if not _stands(standing, BOUND_LEVELS - 1, middle, i, j):
                bounds[:, a, b] = 0


@kernel
def _descend(maxima, standing, beams, middle, window, excluded, limits, node, kept):
    """Search a node, given by turn, row and column, for candidates to be kept."""
    values = kept[1]
    best = values.min()
    stack, tops = np.empty((4 * BOUND_LEVELS, 4), np.int64), np.empty(4 * BOUND_LEVELS, np.int64)
    four, depth = np.empty(4, np.int64), 1
    stack[0, 0], stack[0, 1:], tops[0] = BOUND_LEVELS - 1, node, ABOVE_ALL
    while depth:
        depth -= 1
        level, t, i, j = stack[depth]
        if tops[depth] <= best:
            continue
        if level == 0:
            if not _is_excluded(excluded, t, i, j):
                _keep(kept, t, i, j, tops[depth])
                best = values.min()
            continue
        half = 1 << (level - 1)
        for q in range(4):
            a, b = i + half * (q // 2), j + half * (q % 2)
            four[q] = NO_SUM
            within = a <= window[1] and b <= window[0]
            if within and _stands(standing, level - 1, middle, a, b):
                four[q] = _sum(maxima[level - 1], beams, t, a, b, limits, best)
        for _ in range(4):  # the best one last: it is taken first
            q = np.argmin(four)
            bound, four[q] = four[q], ABOVE_ALL
            if bound > best:
                stack[depth, 0], stack[depth, 1] = level - 1, t
                stack[depth, 2] = i + half * (q // 2)
                stack[depth, 3] = j + half * (q % 2)
                tops[depth] = bound
                depth += 1


@kernel
def _is_excluded(excluded, t, i, j):
    """Whether row i and column j of the window lie in one of the circles."""
    radii, centres = excluded
    for k in range(len(centres)):
        if (j - centres[k, 0]) ** 2 + (i - centres[k, 1]) ** 2 <= radii[t, k]:
            return True
    return False


@kernel
def _descending(values, most):
    """The order of whole numbers from 0 to `most`, the largest first: a counting sort."""
    begins = np.zeros(most + 2, np.int64)
    for value in values:
        begins[most - value + 1] += 1
    begins = np.cumsum(begins)
    order = np.empty(len(values), np.int64)
    for k in range(len(values)):
        order[begins[most - values[k]]] = k
        begins[most - values[k]] += 1
    return order


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
    """The sum of the maxima at the points, or NO_SUM as soon as it cannot exceed `least`."""
    rows, cols, box, places = beams
    high, wide = maxima.shape
    unknown, top = limits
    inside = box[t, 0] + i >= 0 and box[t, 1] + i < high
    if inside and box[t, 2] + j >= 0 and box[t, 3] + j < wide:
        return _sum_inside(maxima.ravel(), places[t], np.uint64(i * wide + j), top, least)
    total, n = 0, rows.shape[1]
    for k in range(n):
        r, c = rows[t, k] + i, cols[t, k] + j
        total += np.int64(maxima[r, c]) if 0 <= r < high and 0 <= c < wide else unknown
        if total + (n - 1 - k) * top <= least:
            return NO_SUM
    return total


@kernel
def _sum_inside(maxima, places, shift, top, least):
    """The same, of points all of which lie in the array (loops of a fixed length are fast)."""
    total, n = 0, len(places)
    whole = n - n % CHUNK
    for begin in range(0, whole, CHUNK):
        for k in range(CHUNK):
            total += maxima[places[np.uint64(begin + k)] + shift]
        if total + (n - CHUNK - begin) * top <= least:
            return NO_SUM
    for k in range(whole, n):
        total += maxima[places[np.uint64(k)] + shift]
    return total if total > least else NO_SUM
