"""Histogram map: how often a cell was how occupied, over windows of time (the paper, 4.2)."""

from __future__ import annotations

import numpy as np
from numba import njit

from slam.checked import positive_number, whole_number
from slam.geometry import Pose2
from slam.grid import GridSpec, grown
from slam.maps.centroids import Centroids
from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays, covering, trace
from slam.scan import Scan

NEVER = np.iinfo(np.int32).min  # the window of a cell that nothing was seen of

MOST = np.iinfo(np.uint16).max  # windows that a bin can count


class Histogram:
    """Keeps per cell a histogram of its occupancy in past windows of time, and matches against all.

    Time is cut into windows of `delta_t`. Within one a cell gathers log-odds, from the prior on,
    like a static map (equation 6); when it is next seen in a later one, the occupancy that it had
    reached is counted in one of B bins. h is the histogram's mean (equation 9, over the windows
    that saw the cell), the open window counting as one more, with the prior as weak evidence.

    resolution  m, side of a cell
    delta_t     s, length of a window
    bins        B; 2 is equation 9 (occupied or free, by the sign of the log-odds with the prior),
                10 is the paper's figure 1
    weight      a, how many windows the prior is worth
    counts      (rows, cols, B) uint16, closed windows by their occupancy: the histogram
    """

    def __init__(
        self,
        resolution: float = 0.05,
        evidence: Evidence = Evidence(),
        rays: Rays = Rays(),
        delta_t: float = 4.0,
        bins: int = 10,
        weight: float = 0.1,
    ):
        positive_number("resolution", resolution)
        positive_number("delta_t", delta_t)
        positive_number("weight", weight)
        whole_number("bins", bins, 2)
        self.evidence = evidence
        self.rays = rays
        self.prior = evidence.prior
        self.resolution = resolution
        self.delta_t = delta_t
        self.bins = bins
        self.weight = weight
        self.spec = GridSpec(resolution, 0, 0, 0, 0)
        self.counts = np.zeros((0, 0, bins), np.uint16)
        self.log_odds = np.zeros(self.spec.shape, np.float32)
        self.window = np.zeros(self.spec.shape, np.int32)
        self.occupied = np.zeros(self.spec.shape, np.float32)
        self.observed = np.zeros(self.spec.shape, np.bool_)
        self.centroids = Centroids(self.spec)
        self._start: float | None = None

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the open window of the cells that it saw."""
        sensor, ends, hit = self.rays.ends(scan, pose)
        self._grow(covering(self.spec, sensor, ends))
        seen = trace(self.spec, sensor, ends, hit)
        evidence = np.where(seen.hit, self.evidence.hit, self.evidence.free).astype(np.float32)
        _observe(
            seen.cells,
            evidence,
            self._window_at(scan.time),
            self.window.reshape(-1),
            self.log_odds.reshape(-1),
            self.counts.reshape(-1, self.bins),
            self.evidence.prior_log_odds,
        )
        self.occupied.reshape(-1)[seen.cells] = self._mean(seen.cells)
        self.observed.reshape(-1)[seen.cells] = True
        self.centroids.add(self.spec, ends[hit])
        return seen.cells

    def histogram(self, row: int, col: int) -> np.ndarray:
        """(B,) number of windows by occupancy of one cell, the open one counted in."""
        counts = self.counts[row, col].astype(np.int64)
        if self.window[row, col] != NEVER:
            counts[_bin(self.log_odds[row, col], self.bins)] += 1
        return counts

    def _window_at(self, time: float) -> int:
        """Number of the window of `time` (s), counted from that of the first scan."""
        if self._start is None:
            self._start = time
        return int((time - self._start) // self.delta_t)

    def _mean(self, cells: np.ndarray) -> np.ndarray:
        """h = (sum_b p_b n_b + a p_0) / (n + a) with p_b = b / (B - 1)."""
        return _means(
            cells,
            self.log_odds.reshape(-1),
            self.counts.reshape(-1, self.bins),
            self.weight,
            self.prior,
        )

    def _grow(self, spec: GridSpec) -> None:
        if spec == self.spec:
            return
        self.counts = grown(self.counts, self.spec, spec, 0)
        self.log_odds = grown(self.log_odds, self.spec, spec, 0.0)
        self.window = grown(self.window, self.spec, spec, NEVER)
        self.occupied = grown(self.occupied, self.spec, spec, self.prior)
        self.observed = grown(self.observed, self.spec, spec, False)
        self.centroids.grow(self.spec, spec)
        self.spec = spec


@njit(cache=True)
def _bin(log_odds, bins):
    """The bin of an occupancy: 0 surely free, bins - 1 surely occupied."""
    return min(int(bins / (1.0 + np.exp(-log_odds))), bins - 1)


@njit(cache=True)
def _observe(cells, evidence, now, window, log_odds, counts, start):
    """Close the windows of cells last seen in an earlier one, then add the evidence."""
    for k in range(len(cells)):
        i = cells[k]
        if window[i] != now:
            if window[i] != NEVER:
                b = _bin(log_odds[i], counts.shape[1])
                counts[i, b] += counts[i, b] < MOST
            log_odds[i] = start
            window[i] = now
        log_odds[i] += evidence[k]


@njit(cache=True)
def _means(cells, log_odds, counts, weight, prior):
    bins = counts.shape[1]
    h = np.empty(len(cells), np.float32)
    for k in range(len(cells)):
        i = cells[k]
        total = 1.0
        occupied = float(_bin(log_odds[i], bins))
        for b in range(bins):
            total += counts[i, b]
            occupied += b * counts[i, b]
        h[k] = (occupied / (bins - 1) + weight * prior) / (total + weight)
    return h
