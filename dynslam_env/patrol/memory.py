"""DynamicMap: the dynamic map of the patrol task, and the information gain of a scan in it."""

from __future__ import annotations

import numpy as np

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.door_belief import DoorBelief
from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.maps.centroids import UNIT
from slam.maps.hmm import HMM, UNDECIDED
from slam.maps.log_odds import Evidence
from slam.maps.rays import WORD, ObservedCells
from slam.maps.tiles import MASK, SHIFT
from slam.scan import Scan

CELL_SIZE = 0.15  # m; large, because a wall on the border between two cells makes both flicker
EVIDENCE = Evidence(hit=3.0, free=-1.0, prior=0.5)
PRIOR_CHANGES = 0.002  # prior number of changes of a cell: few cells ever change, but ...
PRIOR_DWELL = 2.0  # s: ... the rate of one that was seen to change soon becomes large
FULL_WEIGHT_TIME = 3.0  # s in each state, after which a changing cell has its full weight
STATIC_WEIGHT = 0.1  # of a cell that never changed, in the freshness
FRESHNESS_SCALE = 3.0  # s, in which freshness falls to 1 / e; the paper's doors flip after >= 5
PASS_DISTANCE = 0.15  # m: a beam that ends this far behind earlier echoes passed through them ...
PASS_OFFSET = 0.05  # m: ... if it came this close to their centroid
MIN_WATCH_TIME = 10.0  # s, least observation time of a rate of changes


class DynamicMap:
    """An HMM map in coarse cells (Meyer-Delius, Beinhofer and Burgard 2012), the same for any SLAM.

    A cell that never changed keeps its state; the entropy of one that did grows while it is not
    observed, by its rate of changes. A scan therefore brings information again at doors, but not at
    walls.

    A wall fills its cells only partly, and beams that graze it cross them: a cell with earlier
    echoes is observed free only by a beam that passed through their centroid, and the first echo of
    a cell is not a change.

    evidence  of an echo in a cell and of a beam through it
    """

    def __init__(self, evidence: Evidence = EVIDENCE) -> None:
        self._evidence = evidence
        self.map = HMM(CELL_SIZE, evidence, changes=PRIOR_CHANGES, dwell=PRIOR_DWELL)
        self._echoed = self.map.cells.tiles.layer(np.bool_)

    def look(self, scan: Scan, pose: Pose2) -> float:
        """Update the map by a scan at `pose`; returns the information gain, bits: the predicted
        entropy of its cells minus that after the update. Negative for a contradicting scan.
        """
        seen = self._seen(scan, pose)
        known = self.map
        layers = (known.cells.occupied.flat, known.times.flat, known.counts.flat, known.last.flat,
                  known.prior)  # fmt: skip
        before = _entropy(seen.cells, known.since_start(scan.time), *layers)
        known.observe(seen, scan.time)
        return before - _entropy(seen.cells, known.since_start(scan.time), *layers)

    def _seen(self, scan: Scan, pose: Pose2) -> ObservedCells:
        """The cells that a scan observes."""
        cells = self.map.cells
        seen, echoes = cells.trace(scan, pose), cells.centroids
        sensor = pose @ scan.mount
        kept = _observed(seen.cells, seen.hit, np.array(sensor), scan.ranges, scan.angles,
                         CELL_SIZE, cells.tiles.places, echoes.offset.flat,
                         echoes.count.flat)  # fmt: skip
        observed = ObservedCells(seen.cells[kept], seen.hit[kept], seen.echoes)
        _discover(observed.cells, observed.hit, self._echoed.flat, self._evidence.prior,
                  cells.occupied.flat, self.map.state.flat, self.map.times.flat)  # fmt: skip
        return observed

    def freshness(self, time: float) -> float:
        """The recently observed part of the map, in cells: the sum of exp(-age / FRESHNESS_SCALE)
        over all cells with echoes, weighted by STATIC_WEIGHT, and by up to 1 more for a changing
        cell: by the time in its rarer state over FULL_WEIGHT_TIME."""
        known = self.map
        return _freshness(known.since_start(time), self._echoed.flat, known.times.flat,
                          known.counts.flat, known.last.flat)  # fmt: skip

    def occupied(self, points: Array, time: float) -> Array:
        """(n,) P(occupied at `time`) of the cells at points (n, 2), m; NaN where never observed."""
        known = self.map
        cells = known.cells
        return _occupied(self._places(points), known.since_start(time), cells.occupied.flat,
                         cells.observed.flat, known.times.flat, known.counts.flat,
                         known.last.flat, known.prior)  # fmt: skip

    def age(self, points: Array, time: float) -> Array:
        """(n,) s since the cells at points (n, 2), m, were observed; inf where never."""
        known = self.map
        return _ages(self._places(points), known.since_start(time), known.cells.observed.flat,
                     known.last.flat)  # fmt: skip

    def _places(self, points: Array) -> np.ndarray:
        tiles = self.map.cells.tiles
        return _places(points, tiles.index, tiles.origin, 1 / CELL_SIZE)

    def door_beliefs(self, time: float) -> list[DoorBelief]:
        """What is believed of each suspected doorway at `time`, s; a map of cells suspects none."""
        return []

    def beliefs(self, time: float) -> Beliefs:
        """The whole map as arrays, predicted for `time`, s."""
        known, cells, tiles = self.map, self.map.cells, self.map.cells.tiles
        shape, prior = tiles.spec.shape, cells.prior
        found = Beliefs(
            tiles.spec,
            np.full(shape, prior, np.float32),
            np.zeros(shape, np.bool_),
            np.full(shape, np.inf, np.float32),
            np.zeros(shape, np.float32),
        )
        _believe(known.since_start(time), tiles.index, cells.occupied.flat, cells.observed.flat,
                 known.times.flat, known.counts.flat, known.last.flat, known.prior,
                 *found[1:])  # fmt: skip
        return found


@kernel
def _believe(now, index, occupied, observed, times, counts, last, prior, h, seen, ages, flips):
    """Write to `h`, `seen`, `ages` and `flips` (rows, cols) what `Beliefs` has of the observed
    cells; rates as in `HMM.predicted`."""
    changes, words = np.float64(prior.changes), observed.view(np.uint64)
    free_for, occupied_for = np.float32(prior.free_for), np.float32(prior.occupied_for)
    for tile_row, tile_col in np.ndindex(index.shape):
        first = index[tile_row, tile_col] << (2 * SHIFT)
        for begin in range(first, first + (1 << (2 * SHIFT)) if first else 0, WORD):
            for k in range(begin, begin + WORD if words[begin // WORD] else 0):
                if not observed[k]:
                    continue
                row = (tile_row << SHIFT) + ((k >> SHIFT) & MASK)
                col = (tile_col << SHIFT) + (k & MASK)
                age = np.float32(now) - last[k]
                closing = (changes + counts[k, 1]) / (free_for + times[k, 0])
                opening = (changes + counts[k, 0]) / (occupied_for + times[k, 1])
                stationary = closing / (closing + opening)
                left = np.exp(-(closing + opening) * max(age, 0.0))
                watched = max(times[k, 0] + times[k, 1], np.float32(MIN_WATCH_TIME))
                h[row, col] = stationary + left * (occupied[k] - stationary)
                seen[row, col], ages[row, col] = True, age
                flips[row, col] = (np.float64(counts[k, 0]) + np.float64(counts[k, 1])) / watched


@kernel
def _observed(cells, hit, sensor, ranges, angles, side, places, offset, count):
    """(n,) bool: the cell had no echo before, has one now, or a beam passed through its echoes."""
    kept = np.ones(len(cells), np.bool_)
    first, more = angles[0], len(angles) - 1
    apart = (angles[-1] - angles[0]) / more if more else 2.0 * np.pi
    for k in range(len(cells)):
        i = np.uint64(cells[k])
        if hit[k] or count[i] == 0:
            continue
        slot = cells[k] >> (2 * SHIFT)
        row = (places[slot, 0] << SHIFT) + ((cells[k] >> SHIFT) & MASK)
        col = (places[slot, 1] << SHIFT) + (cells[k] & MASK)
        x = (col + 0.5 + offset[i, 0] * UNIT) * side - sensor[0]
        y = (row + 0.5 + offset[i, 1] * UNIT) * side - sensor[1]
        bearing = (np.arctan2(y, x) - sensor[2] - first) % (2.0 * np.pi)
        beam = int(np.round(bearing / apart))
        kept[k] = False
        if beam < len(ranges):
            away = np.hypot(x, y)
            passed = away * abs(bearing - beam * apart) <= PASS_OFFSET
            kept[k] = passed and ranges[beam] >= away + PASS_DISTANCE
    return kept


@kernel
def _discover(cells, hit, echoed, prior, occupied, state, times):
    """Reset cells at their first echo: beams that grazed the wall had counted them as free."""
    for k in range(len(cells)):
        i = np.uint64(cells[k])
        if hit[k] and not echoed[i]:
            echoed[i], occupied[i], state[i], times[i, 0] = True, prior, UNDECIDED, 0.0


@kernel(error_model="numpy")
def _predicted(i, now, occupied, times, counts, last, prior):
    """P(occupied now) of cell `i`: its Markov chain since the last observation."""
    changes, free_for, occupied_for = prior
    h, gone = occupied[i], now - last[i]
    if gone <= 0.0:
        return h
    closing = (changes + counts[i, 1]) / (free_for + times[i, 0])
    opening = (changes + counts[i, 0]) / (occupied_for + times[i, 1])
    stationary = closing / (closing + opening)
    return stationary + np.exp(-(closing + opening) * gone) * (h - stationary)


@kernel(error_model="numpy")
def _entropy(cells, now, occupied, times, counts, last, prior):
    """Sum of the entropies of cells, bits. Most cells are as likely to be occupied as the one
    before, and have its entropy."""
    bits, last_h, entropy = 0.0, -1.0, 0.0
    for k in range(len(cells)):
        h = _predicted(np.uint64(cells[k]), now, occupied, times, counts, last, prior)
        if h != last_h:
            last_h, entropy = h, 0.0
            if 1e-6 < h < 1.0 - 1e-6:
                entropy = h * np.log2(h) + (1.0 - h) * np.log2(1.0 - h)
        bits -= entropy
    return bits


@kernel(error_model="numpy")
def _freshness(now, echoed, times, counts, last):
    total, words = 0.0, echoed.view(np.uint64)
    last_time, left = np.float32(np.nan), 0.0  # cells of one scan follow each other
    for word in range(len(words)):
        for i in range(WORD * word, WORD * (word + 1) if words[word] else 0):
            if echoed[i]:
                weight = STATIC_WEIGHT
                if counts[i, 0] or counts[i, 1]:
                    weight += min(times[i, 0], times[i, 1], FULL_WEIGHT_TIME) / FULL_WEIGHT_TIME
                if last[i] != last_time:
                    last_time, left = last[i], np.exp((last[i] - now) / FRESHNESS_SCALE)
                total += weight * left
    return total


@kernel
def _places(points, index, origin, scale):
    """(n,) indices of the cells at points (n, 2); -1 outside of the map."""
    found = np.full(len(points), -1, np.int64)
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    for k in range(len(points)):
        col = int(np.floor((points[k, 0] - origin[0]) * scale))
        row = int(np.floor((points[k, 1] - origin[1]) * scale))
        if 0 <= row < rows and 0 <= col < cols:
            slot = index[row >> SHIFT, col >> SHIFT]
            found[k] = (slot << (2 * SHIFT)) + ((row & MASK) << SHIFT) + (col & MASK)
    return found


@kernel
def _occupied(places, now, occupied, observed, times, counts, last, prior):
    found = np.full(len(places), np.nan)
    for k in range(len(places)):
        i = places[k]
        if i >= 0 and observed[i]:
            found[k] = _predicted(i, now, occupied, times, counts, last, prior)
    return found


@kernel
def _ages(places, now, observed, last):
    found = np.full(len(places), np.inf)
    for k in range(len(places)):
        i = places[k]
        if i >= 0 and observed[i]:
            found[k] = now - last[i]
    return found
