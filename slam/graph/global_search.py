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
SQUARE = 4  # candidates along the side of the squares that share a bound
TURN_STEP = math.radians(0.5)  # between candidates
MAX_POINTS = 150  # maximum number matched; evenly subsampled: the largest sum is below 1 << LANE
OTHER_DISTANCE = 0.5  # m, OTHER_TURN in rad: two poses farther apart are different places
OTHER_TURN = math.radians(20.0)
MAX_UNITS = 255  # of the field's span, uint8
LANE = 16  # bits of one of the SQUARE sums in a word of 64
EVERY_LANE = np.uint64(sum(1 << LANE * k for k in range(SQUARE)))  # 1 in each
LANE_MASK = np.uint64((1 << LANE) - 1)
MARGIN = SQUARE - 1  # columns of words that begin before the first cell
CHUNK = 64  # numbers that are compared with a limit at once
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
    ):
        """Prepare the map, or only the part between two corners (2,), m, of a region.

        known  whether the place is known: the robot stands where the map is free, and unknown cells
               explain no echo
        """
        tiles, self._pad = endpoint.tiles, SQUARE
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
        cells = explaining if known else every
        self._words = _words(cells, self._unknown)
        self._phases = _phases(_square_maxima(cells, self._unknown), self._unknown)
        self._standing = _squares(every < free) if known else ANYWHERE
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
            self._words, self._phases, self._standing, points[every] / self._cell, turns, middle,
            window, self._excluded(turns, around, but), self._unknown,
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
def _words(cells, unknown):
    """(rows, MARGIN + cols) uint64: each holds SQUARE neighbouring cells of a row, in LANE bits
    each, so that one addition adds to SQUARE sums; those at the borders hold unknown cells too."""
    rows, cols = cells.shape
    words, row = np.empty((rows, MARGIN + cols), np.uint64), np.empty(2 * MARGIN + cols, np.uint64)
    row[:] = unknown
    for r in range(rows):
        for c in range(cols):
            row[MARGIN + c] = cells[r, c]
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
    wide, high = cells.copy(), np.full((rows, cols), unknown, np.uint8)
    for r in range(rows):
        for k in range(1, SQUARE):
            _larger(wide[r, : cols - k], cells[r, k:], wide[r, : cols - k])
        for c in range(max(cols - SQUARE + 1, 0), cols):
            wide[r, c] = max(wide[r, c], unknown)
    for r in range(rows):
        high[r] = wide[r]
        for k in range(r + 1, min(r + SQUARE, rows)):
            _larger(high[r], wide[k], high[r])
        for c in range(cols if r > rows - SQUARE else 0):
            high[r, c] = max(high[r, c], unknown)
    return high


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
def _larger(a, b, result):
    for k in range(len(result)):
        result[k] = a[k] if a[k] > b[k] else b[k]


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


@kernel
def _search(
    words, phases, standing, points, turns, middle, window, excluded, unknown, least, radius, most
):
    """(n, 3) turns, rows and columns of the best candidates above `least`, at most so many, the
    best one first; best square first.

    unknown  the field of unknown cells
    radius   squared, of a place, of which only the best candidate counts
    """
    beams = _beams(points, turns, middle, words.shape[1])
    bounds = _bounds(phases, beams, window, unknown, _spans(standing, middle, window))
    _stand(bounds, standing, middle, window)
    found, values = np.full((most, 3), -1), np.full(most, least)
    kept, sums = (found, values, turns, radius, least), np.empty(SQUARE, np.uint64)
    rows, cols, box, places = beams
    flat, cells, pitch = bounds.ravel(), words.ravel(), words.shape[1]
    high, wide = bounds.shape[1:]
    for first in (True, False):  # the most promising square, then those that may be better
        worst = values.min()
        nodes = _first_largest(flat) if first else _above(flat, worst)
        for o in nodes[_descending(flat[nodes], len(points) * MAX_UNITS)]:
            if flat[o] <= worst:
                break
            t, i, j = o // (high * wide), o // wide % high * SQUARE, o % wide * SQUARE
            i, j = i - window[1], j - window[0]
            inside = box[t, 0] + i >= 0 and box[t, 1] + i + SQUARE <= len(words)
            if inside and box[t, 2] + j >= -MARGIN and box[t, 3] + j < pitch - MARGIN:
                shift = i * pitch + j
                for a in range(SQUARE):  # in this loop: calls count references to arrays
                    total = np.uint64(0)
                    for k in range(places.shape[1]):
                        total += cells[np.uint64(places[t, k] + shift)]
                    sums[a], shift = total, shift + pitch
            else:
                _add_up(words, unknown, rows[t] + i, cols[t] + j + MARGIN, sums)
            if _largest(sums[0], sums[1], sums[2], sums[3]) > worst:
                _keep_best(sums, standing, middle, window, excluded, (t, i, j), kept)
                worst = values.min()
    order = np.argsort(-values, kind="mergesort")
    return found[order[: (values > least).sum()]]


@kernel
def _largest(a, b, c, d):
    """The largest of all lanes of SQUARE words."""
    best = np.uint64(0)
    for word in (a, b, c, d):
        for k in range(SQUARE):
            best = max(best, (word >> np.uint64(LANE * k)) & LANE_MASK)
    return np.int64(best)


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
def _first_largest(values):
    """(1,) the place of the first of the largest whole numbers."""
    most = values[0]
    for k in range(len(values)):
        most = max(most, values[k])
    place = 0
    while values[place] < most:
        place += 1
    return np.full(1, place)


@kernel
def _above(values, least):
    """The places of whole numbers above `least`."""
    places, n = np.empty(1024, np.int64), 0
    for begin in range(0, len(values), CHUNK):
        end, most = min(begin + CHUNK, len(values)), values[begin]
        for k in range(begin, end):
            most = max(most, values[k])
        if most <= least:
            continue
        if n + CHUNK > len(places):
            more = np.empty(2 * len(places), np.int64)
            more[:n] = places[:n]
            places = more
        for k in range(begin, end):
            places[n] = k
            n += values[k] > least
    return places[:n]


@kernel
def _bounds(phases, beams, window, unknown, spans):
    """(turns, rows, cols) uint16 the sums of the maxima over squares of SQUARE candidates; in each
    row only those in `spans` (rows, 2)."""
    rows, cols = beams[0], beams[1]
    high, wide = len(spans), 2 * window[0] // SQUARE + 1
    bounds = np.full((len(rows), high, wide), rows.shape[1] * unknown, np.uint16)
    _, _, tall, broad = phases.shape
    sums, maxima = bounds.ravel(), phases.ravel()
    for t in range(len(rows)):
        for k in range(rows.shape[1]):
            row, col = rows[t, k] - window[1], cols[t, k] - window[0]
            phase = row % SQUARE * SQUARE + col % SQUARE
            row, col = row // SQUARE, col // SQUARE
            for a in range(max(-row, 0), min(tall - row, high)):
                begin, end = max(-col, spans[a, 0]), min(broad - col, spans[a, 1])
                target = np.uint64((t * high + a) * wide)
                source = np.uint64((phase * tall + row + a) * broad + col)
                for b in range(begin, end):  # in this loop: slices count references to arrays
                    sums[target + np.uint64(b)] += maxima[source + np.uint64(b)]
    return bounds


@kernel
def _spans(standing, middle, window):
    """(rows, 2) the first square of each row in which the robot may stand, and the one after the
    last."""
    high, wide = 2 * window[1] // SQUARE + 1, 2 * window[0] // SQUARE + 1
    spans = np.zeros((high, 2), np.int64)
    for a in range(high):
        for b in range(wide):
            if _stands(standing, 1, middle, a * SQUARE - window[1], b * SQUARE - window[0]):
                if spans[a, 1] == 0:
                    spans[a, 0] = b
                spans[a, 1] = b + 1
    return spans


@kernel
def _stand(bounds, standing, middle, window):
    """Set the bounds of squares to zero where no robot may stand."""
    if not len(standing):
        return
    mask = np.empty(bounds.shape[1:], np.uint16)
    for a in range(bounds.shape[1]):
        for b in range(bounds.shape[2]):
            i, j = a * SQUARE - window[1], b * SQUARE - window[0]
            mask[a, b] = 0xFFFF if _stands(standing, 1, middle, i, j) else 0
    flat, kept = bounds.ravel(), mask.ravel()
    for begin in range(0, len(flat), len(kept)):
        for k in range(len(kept)):
            flat[begin + k] &= kept[k]


@kernel
def _keep_best(sums, standing, middle, window, excluded, node, kept):
    """Keep the candidates of a square, given by turn, row and column, that are good enough."""
    t, i, j = node
    values = kept[1]
    for r in range(min(SQUARE, window[1] - i + 1)):
        for c in range(min(SQUARE, window[0] - j + 1)):
            value = np.int64((sums[r] >> np.uint64(LANE * c)) & LANE_MASK)
            if value <= values.min() or not _stands(standing, 0, middle, i + r, j + c):
                continue
            if not _is_excluded(excluded, t, i + r, j + c):
                _keep(kept, t, i + r, j + c, value)


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
    """Whether the robot may stand at row i and column j of the window (level 0), or somewhere in
    the square from there on (1)."""
    if not len(standing):
        return True
    r, c = int(np.floor(middle[1])) + i, int(np.floor(middle[0])) + j
    _, high, wide = standing.shape
    return 0 <= r < high and 0 <= c < wide and standing[level, r, c]


@kernel
def _beams(points, turns, middle, wide):
    """(turns, n) rows and columns of the points' cells, (turns, 4) their least and largest, and
    (turns, n) their places in `words` of that many columns."""
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
    return rows, cols, box, rows * wide + cols + MARGIN


@kernel
def _add_up(words, unknown, rows, cols, sums):
    """Write to sums (SQUARE,) those of the words at rows and columns (n,), and in the rows above;
    words that do not exist hold `unknown` cells."""
    high, wide = words.shape
    sums[:] = 0
    for k in range(len(rows)):
        for a in range(SQUARE):
            within = 0 <= rows[k] + a < high and 0 <= cols[k] < wide
            sums[a] += words[rows[k] + a, cols[k]] if within else EVERY_LANE * np.uint64(unknown)
