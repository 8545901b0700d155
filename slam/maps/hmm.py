"""HMM map: every cell a Markov chain that opens and closes at rates learned on the way.

Meyer-Delius, Beinhofer and Burgard 2012; the rates from counted changes, Saarinen et al. 2012.
"""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays, Seen
from slam.maps.tiles import AREA
from slam.scan import Scan
from slam.validation import positive_number

UNDECIDED, FREE, OCCUPIED = 0, 1, 2
SURE = 0.8  # P of a state from where on the cell is taken to be in it
MOST = 255  # changes that are counted


class HMM:
    """Expects a cell to change as often as it did: a door soon, a wall hardly ever.

    Between two sights of a cell the chain runs for their distance in time t: with a the rate of
    closing, b that of opening and pi = a / (a + b), p goes to pi + exp(-(a + b) t) (p - pi). Then
    comes Bayes with the evidence. A cell is taken to be free or occupied when that is 80 % sure;
    a = (changes + closings) / (free for + seconds), b likewise, where the prior's `changes` and
    seconds are what a cell begins with, the seconds split such that pi is the evidence's prior.
    A gap in which a chain forgets where it was, 1 / (a + b), teaches nothing of its changes.

    h is that of when the cell was last seen. To relax it to pi while nobody looks, all cells would
    have to be gone through with every scan; `predicted` does so when asked.

    resolution  m, side of a cell
    changes     that a cell is taken to have made already, in each direction
    dwell       s, in which it made them
    times       layer of (2,) float32, s watched while free and while occupied
    counts      layer of (2,) uint8, openings and closings; beyond 255 all counts half, times too
    state       layer, uint8, UNDECIDED, FREE or OCCUPIED
    last        layer, float32, s since the first scan: when the cell was last seen
    """

    def __init__(
        self,
        resolution: float = 0.05,
        evidence: Evidence = Evidence(),
        rays: Rays = Rays(),
        changes: float = 0.5,
        dwell: float = 60.0,
    ):
        positive_number("changes", changes)
        positive_number("dwell", dwell)
        self.evidence = evidence
        self._ratios = np.exp(evidence.hit), np.exp(evidence.free)
        self.changes = changes
        self.dwell = dwell
        self.cells = Cells(resolution, evidence.prior, rays)
        tiles = self.cells.tiles
        self.times = tiles.layer(np.float32, 0, (AREA, 2))
        self.counts = tiles.layer(np.uint8, 0, (AREA, 2))
        self.state = tiles.layer(np.uint8, UNDECIDED)
        self.last = tiles.layer(np.float32)
        self._start: float | None = None

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Predict the cells that the scan saw, correct them, and learn how often they change."""
        seen = self.cells.see(scan, pose)
        self.observe(seen, scan.time)
        return seen.cells

    def observe(self, seen: Seen, time: float) -> None:
        """The same for cells that were `seen` at `time`, s."""
        if self._start is None:
            self._start = time
        _observe(
            seen.cells,
            seen.hit,
            time - self._start,
            self.times.flat,
            self.counts.flat,
            self.state.flat,
            self.last.flat,
            self.cells.occupied.flat,
            *self._ratios,
            *self.prior,
        )

    @property
    def prior(self) -> tuple[float, float, float]:
        """The changes, the seconds free and the seconds occupied that a cell begins with."""
        prior = self.evidence.prior
        return self.changes, (1 - prior) * self.dwell, prior * self.dwell

    def since_start(self, time: float) -> float:
        """s from the first scan to `time`, as `last` counts it; 0 before there is one."""
        return 0.0 if self._start is None else time - self._start

    def rates(self, row: int, col: int) -> tuple[float, float]:
        """How often a cell of the grid closes while free and opens while occupied, 1/s."""
        cell = self.cells.tiles.cell(row, col)
        closing, opening = self._rates(self.times.flat[cell], self.counts.flat[cell])
        return float(closing), float(opening)

    def predicted(self, time: float) -> OccupancyGrid:
        """The map as it will have become at `time`, s, if nothing more is seen."""
        tiles = self.cells.tiles
        grid = self.cells.grid()
        if self._start is None:
            return grid
        closing, opening = self._rates(tiles.dense(self.times), tiles.dense(self.counts))
        stationary = closing / (closing + opening)
        gone = np.maximum(time - self._start - tiles.dense(self.last), 0)
        left = np.exp(-(closing + opening) * gone)
        h = stationary + left * (grid.occupied - stationary)
        return OccupancyGrid(grid.spec, np.where(grid.observed, h, grid.occupied), grid.observed)

    def _rates(self, times: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Closing and opening (...) from times and counts (..., 2), 1/s."""
        changes, free_for, occupied_for = self.prior
        closing = (changes + counts[..., 1]) / (free_for + times[..., 0])
        opening = (changes + counts[..., 0]) / (occupied_for + times[..., 1])
        return closing, opening


@kernel(error_model="numpy")
def _observe(
    cells, hit, now, times, counts, state, last, occupied, hit_ratio, free_ratio, changes,
    free_for, occupied_for,
):  # fmt: skip
    """Predict, correct and learn; the ratios are p(z|occupied) / p(z|free)."""
    for k in range(len(cells)):
        i = np.uint64(cells[k])
        gone = max(now - last[i], 0.0)
        last[i] = now
        closing = (changes + counts[i, 1]) / (free_for + times[i, 0])
        opening = (changes + counts[i, 0]) / (occupied_for + times[i, 1])
        stationary = closing / (closing + opening)
        h = stationary + np.exp(-(closing + opening) * gone) * (occupied[i] - stationary)
        ratio = (hit_ratio if hit[k] else free_ratio) * h
        h = ratio / (ratio + 1.0 - h)
        occupied[i] = h
        was = state[i] if gone * (closing + opening) < 1.0 else UNDECIDED
        state[i] = OCCUPIED if h > SURE else FREE if h < 1.0 - SURE else was
        if was != UNDECIDED:
            times[i, was - FREE] += gone
            if state[i] != was:
                _count(times, counts, i, state[i] - FREE)


@kernel
def _count(times, counts, i, to):
    """One change more; where they are full, all that was learned so far counts half."""
    if counts[i, to] == MOST:
        for s in range(2):
            counts[i, s] = (counts[i, s] + 1) // 2
            times[i, s] *= 0.5
    counts[i, to] += np.uint8(1)
