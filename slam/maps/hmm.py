"""HMM map: each cell is a two-state Markov chain whose transition rates are learned online.

Meyer-Delius, Beinhofer and Burgard 2012; the rates from counted changes, Saarinen et al. 2012.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence
from slam.maps.rays import ObservedCells, Rays
from slam.maps.tiles import AREA
from slam.scan import Scan
from slam.validation import positive_number

UNDECIDED, FREE, OCCUPIED = 0, 1, 2
STATE_PROBABILITY = 0.8  # P of a state from which on the cell is taken to be in it
MAX_CHANGES = 255  # changes counted per cell and direction, uint8


class HMMLayers(NamedTuple):
    """The layers of an `HMM`, flat: (cells,), times and counts (cells, 2)."""

    times: np.ndarray
    counts: np.ndarray
    state: np.ndarray
    last: np.ndarray
    occupied: np.ndarray


class RatePrior(NamedTuple):
    """The counts and times of a cell that was never observed.

    changes       in each direction
    free_for      s
    occupied_for  s
    """

    changes: float
    free_for: float
    occupied_for: float


class HMM:
    """Predicts that a cell changes as often as it did so far: a door often, a wall hardly ever.

    Between two observations of a cell, t apart, its state probability is predicted: with a the rate
    of closing, b that of opening and pi = a / (a + b), p becomes pi + exp(-(a + b) t) (p - pi).
    Then it is updated with the evidence by Bayes' rule. A cell is taken to be free or occupied at a
    probability of 80 %; a = (changes + closings) / (free for + seconds), b likewise, where the
    prior's `changes` and seconds are what a cell begins with, the seconds split such that pi is the
    evidence's prior. A gap longer than 1 / (a + b), after which the chain has forgotten its state,
    is not used to learn the rates.

    h is of the time when the cell was last observed. Relaxing all unobserved cells towards pi would
    mean a pass over the map with every scan; `predicted` computes it on demand.

    resolution  m, side of a cell
    changes     prior number of changes, in each direction
    dwell       s, prior time in which they happened
    times       layer of (2,) float32, s observed while free and while occupied
    counts      layer of (2,) uint8, openings and closings; beyond 255 counts and times are halved
    state       layer, uint8, UNDECIDED, FREE or OCCUPIED
    last        layer, float32, s from the first scan to the last observation of the cell
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
        observed = self.cells.trace(scan, pose)
        self.observe(observed, scan.time)
        return observed.cells

    def observe(self, observed: ObservedCells, time: float) -> None:
        """The same for cells `observed` at `time`, s."""
        if self._start is None:
            self._start = time
        layers = HMMLayers(
            self.times.flat,
            self.counts.flat,
            self.state.flat,
            self.last.flat,
            self.cells.occupied.flat,
        )
        _observe(observed, time - self._start, layers, self._ratios, self.prior)

    @property
    def prior(self) -> RatePrior:
        """The changes and times that a cell begins with."""
        prior = self.evidence.prior
        return RatePrior(self.changes, (1 - prior) * self.dwell, prior * self.dwell)

    def since_start(self, time: float) -> float:
        """s from the first scan to `time`, as in the layer `last`; 0 before the first scan."""
        return 0.0 if self._start is None else time - self._start

    def rates(self, row: int, col: int) -> tuple[float, float]:
        """Rates of closing (while free) and opening (while occupied) of a cell of the grid, 1/s."""
        cell = self.cells.tiles.cell(row, col)
        closing, opening = self._rates(self.times.flat[cell], self.counts.flat[cell])
        return float(closing), float(opening)

    def predicted(self, time: float) -> OccupancyGrid:
        """The map predicted for `time`, s, without further observations."""
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
def _observe(observed: ObservedCells, now, layers: HMMLayers, ratios, prior: RatePrior):
    """Predict, correct and learn the rates.

    ratios  p(z|occupied) / p(z|free) of a hit and of a beam that passes through
    """
    cells, hit = observed.cells, observed.hit
    times, counts, state, last, occupied = layers
    changes, free_for, occupied_for = prior
    hit_ratio, free_ratio = ratios
    for k in range(len(cells)):
        i = np.uint64(cells[k])
        gone = max(now - last[i], 0.0)
        last[i] = now
        closing = (changes + counts[i, 1]) / (free_for + times[i, 0])
        opening = (changes + counts[i, 0]) / (occupied_for + times[i, 1])
        stationary = closing / (closing + opening)
        kept = np.exp(-(closing + opening) * gone) if gone > 0.0 else 1.0
        h = stationary + kept * (occupied[i] - stationary)
        ratio = (hit_ratio if hit[k] else free_ratio) * h
        h = ratio / (ratio + 1.0 - h)
        occupied[i] = h
        was = state[i] if gone * (closing + opening) < 1.0 else UNDECIDED
        if h > STATE_PROBABILITY:
            state[i] = OCCUPIED
        elif h < 1.0 - STATE_PROBABILITY:
            state[i] = FREE
        else:
            state[i] = was
        if was != UNDECIDED:
            times[i, was - FREE] += gone
            if state[i] != was:
                _count(times, counts, i, state[i] - FREE)


@kernel
def _count(times, counts, i, to):
    """Count a change of cell `i`; if the count is full, halve its counts and times first."""
    if counts[i, to] == MAX_CHANGES:
        for s in range(2):
            counts[i, s] = (counts[i, s] + 1) // 2
            times[i, s] *= 0.5
    counts[i, to] += np.uint8(1)
