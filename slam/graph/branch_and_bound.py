"""Branch and bound over the turns, rows and columns of candidates (Hess et al. 2016).

Rows and columns are counted from the middle of the window. SQUARE x SQUARE candidates of a turn
share a bound; their sums are added up SQUARE at a time, as lanes of one word.
"""

from __future__ import annotations

import numpy as np

from slam.graph.kept_places import best_first, keep, no_places
from slam.kernel import kernel
from slam.sensor_models.pyramid import MAX_UNITS

SQUARE = 4  # candidates along the side of the squares that share a bound
LANE = 16  # bits of one of the SQUARE sums in a word of 64
EVERY_LANE = np.uint64(sum(1 << LANE * k for k in range(SQUARE)))  # 1 in each
LANE_MASK = np.uint64((1 << LANE) - 1)
HALF_LANE = LANE // 2  # bits of a cell
CELL_MASK = EVERY_LANE * np.uint64((1 << HALF_LANE) - 1)  # the lower half of each lane
MARGIN = SQUARE - 1  # columns of words that begin before the first cell
LONG_ROW, MOST_PADDED = 24, 3  # squares; their number in a row with padding, by that without
FEW = 8  # squares of a row that are added up at once, in windows at most so wide
U_0, U_1, U_2, U_3, U_4, U_5, U_6, U_7 = [np.uint64(k) for k in range(8)]
U_FEW, U_HALF = np.uint64(FEW), np.uint64(HALF_LANE)  # unsigned: numba need not check the sign
CHUNK = 64  # numbers that are compared with a limit at once


@kernel
def best_candidates(
    words, phases, standing, points, turns, middle, window, excluded, unknown, least, radius, most
):
    """(n, 3) turns, rows and columns of the best candidates above `least`, at most so many, the
    best one first; best square first.

    words, phases, standing  the map, see `GlobalSearch`
    points, turns, middle, window  cells, rad, and cells: what is searched for, and where
    excluded  see `GlobalSearch._excluded`
    unknown  the field of unknown cells
    radius   squared, of a place, of which only the best candidate counts
    """
    beams = _beams(points, turns, middle, words.shape[1])
    runs, squares = runs_of(standing, middle, window)
    bounds = bounds_of(phases, beams, runs, len(squares), window, unknown)
    if not len(squares):
        return np.empty((0, 3), np.int64)
    kept, sums = no_places(most, least, turns, radius, window), np.empty(SQUARE, np.uint64)
    rows, cols, box, places = beams
    flat, cells, pitch = bounds.ravel(), words.ravel(), words.shape[1]
    up = np.uint64(pitch)
    for first in (True, False):  # the most promising square, then those that may be better
        worst = kept.values.min()
        nodes = _first_largest(flat) if first else _above(flat, worst)
        for o in nodes[_descending(flat[nodes], len(points) * MAX_UNITS)]:
            if flat[o] <= worst:
                break
            t, square = o // len(squares), o % len(squares)
            i, j = squares[square, 0] - window[1], squares[square, 1] - window[0]
            inside = box[t, 0] + i >= 0 and box[t, 1] + i + SQUARE <= len(words)
            if inside and box[t, 2] + j >= -MARGIN and box[t, 3] + j < pitch - MARGIN:
                shift = i * pitch + j
                a = b = c = d = np.uint64(0)
                for k in range(places.shape[1]):  # here: calls count references to arrays
                    place = np.uint64(places[t, k] + shift)
                    low, high = cells[place], cells[place + U_2 * up]
                    a, b = a + (low & CELL_MASK), b + ((low >> U_HALF) & CELL_MASK)
                    c, d = c + (high & CELL_MASK), d + ((high >> U_HALF) & CELL_MASK)
                sums[0], sums[1], sums[2], sums[3] = a, b, c, d
            else:
                _add_up(words, unknown, rows[t] + i, cols[t] + j + MARGIN, sums)
            if _largest(sums[0], sums[1], sums[2], sums[3]) > worst:
                node = t, i, j
                worst = _keep_best(sums, standing, middle, window, excluded, node, kept, worst)
    return best_first(kept)


@kernel
def _largest(a, b, c, d):
    """The largest of all lanes of SQUARE words."""
    best = np.uint64(0)
    for word in (a, b, c, d):
        for k in range(SQUARE):
            best = max(best, (word >> np.uint64(LANE * k)) & LANE_MASK)
    return np.int64(best)


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
def runs_of(standing, middle, window):
    """The squares of a window in which the robot may stand somewhere, row by row: (m, 4) runs of
    them (row, first column, the one after the last, number of squares before it), rows and columns
    in squares; and (n, 2) the row and column of each in candidates from the window's corner."""
    high, wide = 2 * window[1] // SQUARE + 1, 2 * window[0] // SQUARE + 1
    runs, squares = (
        np.empty((high * (wide // 2 + 1), 4), np.int64),
        np.empty((high * wide, 2), np.int64),
    )
    m = n = 0
    for a in range(high):
        within = False
        for b in range(wide):
            stands = _stands(standing, 1, middle, a * SQUARE - window[1], b * SQUARE - window[0])
            if stands:
                if not within:
                    runs[m, 0], runs[m, 1], runs[m, 3], m = a, b, n, m + 1
                runs[m - 1, 2] = b + 1
                squares[n, 0], squares[n, 1], n = a * SQUARE, b * SQUARE, n + 1
            within = stands
    return runs[:m].copy(), squares[:n].copy()


@kernel
def bounds_of(phases, beams, runs, n, window, unknown):
    """(turns, n) uint16 the sums of the maxima over the n squares of `runs`.

    Those of a turn are added up in a whole window: rows of up to FEW squares by FEW at once, long
    rows all at once: they are as long as those of the maxima then, beside which there are zeros.
    """
    rows, cols, box, _ = beams
    _, _, tall, broad = phases.shape
    high, wide = 2 * window[1] // SQUARE + 1, 2 * window[0] // SQUARE + 1
    length, pitch, maxima, blank = max(wide, FEW), broad, phases.reshape(-1, broad), 0
    least = (box[:, 2].min() - window[0]) // SQUARE
    most = (box[:, 3].max() - window[0]) // SQUARE
    padded_length = max(broad, broad - least, wide, wide + most)
    at_once = wide >= LONG_ROW and padded_length < MOST_PADDED * wide
    if at_once:
        length, pitch, blank = padded_length, padded_length, 1  # rows before and after the others
        padded = np.zeros((len(maxima) + 2 * blank, pitch), np.uint16)
        padded[blank:-blank, :broad] = maxima
        maxima = padded
    bounds, values = np.empty((len(rows), n), np.uint16), maxima.ravel()
    sums = np.empty(high * length, np.uint16)
    places, spans = np.empty(rows.shape[1], np.uint64), np.empty((rows.shape[1], 3), np.int64)
    for t in range(len(rows)):
        sums[:] = rows.shape[1] * unknown
        inside = 0
        for k in range(rows.shape[1]):
            row, col = rows[t, k] - window[1], cols[t, k] - window[0]
            phase = row % SQUARE * SQUARE + col % SQUARE
            row, col = row // SQUARE, col // SQUARE
            source = (blank + phase * tall + row) * pitch + col
            begin, end = max(-row, 0), min(tall - row, high)
            if at_once:
                spans[k, 0], spans[k, 1], spans[k, 2] = begin * pitch, end * pitch, source
            elif length == FEW and 0 <= row <= tall - high and 0 <= col <= broad - FEW:
                places[inside] = source
                inside += 1
            else:
                left, right = max(-col, 0), min(broad - col, wide)
                for a in range(begin, end):
                    target, first = np.uint64(a * length), np.uint64(source + a * pitch)
                    for b in range(left, right):  # here: slices count references to arrays
                        sums[target + np.uint64(b)] += values[first + np.uint64(b)]
        if at_once:
            _add_spans(sums, values, spans)
        for a in range(np.uint64(high) if inside else U_0):
            _add_eight(
                sums[a * U_FEW : (a + U_1) * U_FEW], values[a * np.uint64(broad) :], places[:inside]
            )
        for m in range(len(runs)):
            begin = np.uint64(runs[m, 0] * length + runs[m, 1])
            for b in range(np.uint64(runs[m, 2] - runs[m, 1])):
                bounds[np.uint64(t), np.uint64(runs[m, 3]) + b] = sums[begin + b]
    return bounds


@kernel
def _add_spans(sums, values, spans):
    """Add to the sums of each span (n, 3), from the first one to the one before the second, the
    values that lie the third number after them; of four spans at a time where all overlap."""
    fours = len(spans) - len(spans) % 4
    for k in range(0, fours, 4):
        begin, end = spans[k : k + 4, 0].max(), spans[k : k + 4, 1].min()
        end = max(begin, end)
        a, b, c, d = spans[k, 2], spans[k + 1, 2], spans[k + 2, 2], spans[k + 3, 2]
        for x in range(np.uint64(begin), np.uint64(end)):
            sums[x] += (
                values[np.uint64(a) + x] + values[np.uint64(b) + x]
                + values[np.uint64(c) + x] + values[np.uint64(d) + x]
            )  # fmt: skip
        for m in range(k, k + 4):
            _add_span(sums, values, spans[m, 0], min(begin, spans[m, 1]), spans[m, 2])
            _add_span(sums, values, max(end, spans[m, 0]), spans[m, 1], spans[m, 2])
    for m in range(fours, len(spans)):
        _add_span(sums, values, spans[m, 0], spans[m, 1], spans[m, 2])


@kernel
def _add_span(sums, values, begin, end, source):
    """The same of one span."""
    for x in range(np.uint64(begin), np.uint64(max(begin, end))):
        sums[x] += values[np.uint64(source) + x]


@kernel
def _add_eight(sums, values, places):
    """Add eight neighbouring values from each of the places on to eight sums."""
    a, b, c, d = sums[U_0], sums[U_1], sums[U_2], sums[U_3]
    e, f, g, h = sums[U_4], sums[U_5], sums[U_6], sums[U_7]
    for place in places:
        a += values[place]
        b += values[place + U_1]
        c += values[place + U_2]
        d += values[place + U_3]
        e += values[place + U_4]
        f += values[place + U_5]
        g += values[place + U_6]
        h += values[place + U_7]
    sums[U_0], sums[U_1], sums[U_2], sums[U_3] = a, b, c, d
    sums[U_4], sums[U_5], sums[U_6], sums[U_7] = e, f, g, h


@kernel
def _keep_best(sums, standing, middle, window, excluded, node, kept, worst):
    """Keep the candidates of a square, given by turn, row and column, that are better than the
    `worst` one that is kept; returns the worst one then."""
    t, i, j = node
    for r in range(min(SQUARE, window[1] - i + 1)):
        for c in range(min(SQUARE, window[0] - j + 1)):
            value = np.int64((sums[r] >> np.uint64(LANE * c)) & LANE_MASK)
            if value <= worst or not _stands(standing, 0, middle, i + r, j + c):
                continue
            if not _is_excluded(excluded, t, i + r, j + c):
                worst = keep(kept, t, i + r, j + c, value, worst)
    return worst


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
            word = (
                words[rows[k] + a, cols[k]] & CELL_MASK
                if within
                else EVERY_LANE * np.uint64(unknown)
            )
            sums[a] += word
