"""Memory: the dynamic map of the task, and how many bits a scan adds to it."""

from __future__ import annotations

import numpy as np

from dynslam_env.navigation.beliefs import Beliefs
from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.maps.centroids import UNIT
from slam.maps.hmm import HMM, UNDECIDED
from slam.maps.log_odds import Evidence
from slam.maps.rays import WORD, ObservedCells
from slam.maps.tiles import MASK, SHIFT
from slam.scan import Scan

CELL = 0.15  # m; walls hardly ever lie on the border between two such cells, and flicker there
EVIDENCE = Evidence(hit=3.0, free=-1.0, prior=0.5)
CHANGES = 0.002  # that a cell is taken to have made: hardly any cell ever changes, but ...
DWELL = 2.0  # s: ... one that was seen to change is soon taken to do so often
BOTH = 3.0  # s that a cell was watched free and occupied before it counts in full as changing
STANDS = 0.1  # what a cell is worth that never changed: it may yet
FADES = 3.0  # s, after which a look is worth 1 / e: no door of the paper's flips within 5
BEYOND = 0.15  # m: a beam that ends so far behind the place of an echo went through it ...
ASIDE = 0.05  # m: ... if it passed it this closely
WATCHED = 10.0  # s that a cell counts as watched at least: one change at once is no rate


class DynamicMap:
    """An HMM map in coarse cells (Meyer-Delius, Beinhofer and Burgard 2012), whatever the SLAM.

    Cells that never changed are taken to stay as they are; one that did is less and less sure while
    nobody looks, at the rate at which it changed. What a scan tells is thereby worth something
    again where doors are, and nothing where only walls are.

    A wall fills its cells only in part, and beams that graze it cross them: a cell that echoes came
    from is seen free only by a beam that went through where they came from, and the first echo of
    all is a discovery, not a change.
    """

    def __init__(self) -> None:
        self.map = HMM(CELL, EVIDENCE, changes=CHANGES, dwell=DWELL)
        self._echoed = self.map.cells.tiles.layer(np.bool_)

    def look(self, scan: Scan, pose: Pose2) -> float:
        """Take in a scan made at `pose`; the information gained, bits: the entropy of its cells as
        they were predicted, less what is left of it. Negative where it contradicts what was known.
        """
        seen = self._told(scan, pose)
        before = self._entropy(seen.cells, scan.time)
        self.map.observe(seen, scan.time)
        return before - self._entropy(seen.cells, scan.time)

    def _told(self, scan: Scan, pose: Pose2) -> ObservedCells:
        """The cells that a scan tells something of."""
        cells = self.map.cells
        seen, echoes = cells.trace(scan, pose), cells.centroids
        sensor = pose @ scan.mount
        kept = _told(seen.cells, seen.hit, np.array(sensor), scan.ranges, scan.angles, CELL,
                     cells.tiles.places, echoes.offset.flat, echoes.count.flat)  # fmt: skip
        told = ObservedCells(seen.cells[kept], seen.hit[kept], seen.echoes)
        _discover(told.cells, told.hit, self._echoed.flat, EVIDENCE.prior, cells.occupied.flat,
                  self.map.state.flat, self.map.times.flat)  # fmt: skip
        return told

    def _entropy(self, cells: np.ndarray, time: float) -> float:
        known = self.map
        return _entropy(cells, known.since_start(time), known.cells.occupied.flat, known.times.flat,
                        known.counts.flat, known.last.flat, known.prior)  # fmt: skip

    def freshness(self, time: float) -> float:
        """How much of what stands or stood somewhere was seen lately, in cells: the sum over all
        cells that echoes came from of exp(-age / FADES), weighed by STANDS, and by 1 more for a
        cell that was seen to change, once it was watched for BOTH s in the state in which it was
        less."""
        known = self.map
        return _freshness(known.since_start(time), self._echoed.flat, known.times.flat,
                          known.counts.flat, known.last.flat)  # fmt: skip

    def occupied(self, points: Array, time: float) -> Array:
        """(n,) P(occupied at `time`) of the cells at points (n, 2), m; NaN where never seen."""
        known = self.map
        cells = known.cells
        return _occupied(points, cells.tiles.index, cells.tiles.origin, 1 / CELL,
                         known.since_start(time), cells.occupied.flat, cells.observed.flat,
                         known.times.flat, known.counts.flat, known.last.flat,
                         known.prior)  # fmt: skip

    def beliefs(self, time: float) -> Beliefs:
        """All of it, as predicted for `time`, s."""
        known, tiles = self.map, self.map.cells.tiles
        grid = known.predicted(time)
        age = known.since_start(time) - tiles.dense(known.last)
        watched = np.maximum(tiles.dense(known.times).sum(axis=2), WATCHED)
        flips = tiles.dense(known.counts).sum(axis=2) / watched
        return Beliefs(
            grid.spec,
            grid.occupied.astype(np.float32),
            grid.observed,
            np.where(grid.observed, age, np.inf).astype(np.float32),
            flips.astype(np.float32),
        )


@kernel
def _told(cells, hit, sensor, ranges, angles, side, places, offset, count):
    """(n,) bool: echoes never came from there, one does now, or a beam went through that place."""
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
            passed = away * abs(bearing - beam * apart) <= ASIDE
            kept[k] = passed and ranges[beam] >= away + BEYOND
    return kept


@kernel
def _discover(cells, hit, echoed, prior, occupied, state, times):
    """Forget that cells with their first echo were taken to be free: they had been grazed."""
    for k in range(len(cells)):
        i = np.uint64(cells[k])
        if hit[k] and not echoed[i]:
            echoed[i], occupied[i], state[i], times[i, 0] = True, prior, UNDECIDED, 0.0


@kernel
def _predicted(i, now, occupied, times, counts, last, prior):
    """P(occupied now) of cell `i`: the chain has run since it was seen."""
    changes, free_for, occupied_for = prior
    h, gone = occupied[i], now - last[i]
    if gone <= 0.0:
        return h
    closing = (changes + counts[i, 1]) / (free_for + times[i, 0])
    opening = (changes + counts[i, 0]) / (occupied_for + times[i, 1])
    stationary = closing / (closing + opening)
    return stationary + np.exp(-(closing + opening) * gone) * (h - stationary)


@kernel
def _entropy(cells, now, occupied, times, counts, last, prior):
    """Bits of all cells together."""
    bits = 0.0
    for k in range(len(cells)):
        h = _predicted(np.uint64(cells[k]), now, occupied, times, counts, last, prior)
        if 1e-6 < h < 1.0 - 1e-6:
            bits -= h * np.log2(h) + (1.0 - h) * np.log2(1.0 - h)
    return bits


@kernel
def _freshness(now, echoed, times, counts, last):
    total, words = 0.0, echoed.view(np.uint64)
    for word in range(len(words)):
        for i in range(WORD * word, WORD * (word + 1) if words[word] else 0):
            if echoed[i]:
                weight = STANDS
                if counts[i, 0] or counts[i, 1]:
                    weight += min(times[i, 0], times[i, 1], BOTH) / BOTH
                total += weight * np.exp((last[i] - now) / FADES)
    return total


@kernel
def _occupied(
    points, index, origin, scale, now, occupied, observed, times, counts, last, prior
):  # fmt: skip
    found = np.full(len(points), np.nan)
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    for k in range(len(points)):
        col = int(np.floor((points[k, 0] - origin[0]) * scale))
        row = int(np.floor((points[k, 1] - origin[1]) * scale))
        if 0 <= row < rows and 0 <= col < cols:
            slot = index[row >> SHIFT, col >> SHIFT]
            i = (slot << (2 * SHIFT)) + ((row & MASK) << SHIFT) + (col & MASK)
            if observed[i]:
                found[k] = _predicted(i, now, occupied, times, counts, last, prior)
    return found
