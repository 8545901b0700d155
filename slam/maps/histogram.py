"""Histogram map: per-cell histogram of occupancy over windows of time (the paper, 4.2)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Pose2
from slam.kernel import kernel
from slam.maps.rays import ObservedCells
from slam.maps.tiles import AREA, Tiles
from slam.maps.windowed import MAX_WINDOWS, NO_WINDOW, Windowed, WindowParameters, bin_of
from slam.scan import Scan


class HistogramLayers(NamedTuple):
    """The layers of a `Histogram`, flat: (cells,), counts (cells, B)."""

    window: np.ndarray
    log_odds: np.ndarray
    counts: np.ndarray
    occupied: np.ndarray


class Histogram(Windowed):
    """Keeps per cell a histogram of its occupancy in all past windows; h is the histogram's mean.

    Time is cut into windows of `delta_t`. Within a window a cell accumulates log-odds, starting at
    the prior, like a static map (equation 6). When the cell is next observed in a later window, the
    occupancy that it had reached is counted in one of B bins. h is the mean of the histogram
    (equation 9, over the windows that observed the cell), in which the open window counts as one
    more and the prior as weak evidence.

    resolution  m, side of a cell
    delta_t     s, length of a window
    bins        B; 2 is equation 9 (occupied or free, by the sign of the log-odds with the prior),
                10 is the paper's figure 1
    weight      a, the prior's weight in windows
    counts      layer of (B,) uint8, closed windows by their occupancy: the histogram. When a bin
                would exceed 255, all bins of its cell are halved: old windows fade
    """

    def _add_layers(self, tiles: Tiles) -> None:
        self.counts = tiles.layer(np.uint8, 0, (AREA, self.bins))
        self.log_odds = tiles.layer(np.float32, self.evidence.prior_log_odds)
        self.window = tiles.layer(np.int32, NO_WINDOW)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the open window of the observed cells."""
        observed = self.cells.trace(scan, pose)
        layers = HistogramLayers(
            self.window.flat, self.log_odds.flat, self.counts.flat, self.cells.occupied.flat
        )
        return _observe(observed, self._clock.at(scan.time), layers, self._parameters)

    def histogram(self, row: int, col: int) -> np.ndarray:
        """(B,) number of windows by occupancy of one cell of the grid, the open one included."""
        cell = self.cells.tiles.cell(row, col)
        counts = self.counts.flat[cell].astype(np.int64)
        if self.window.flat[cell] != NO_WINDOW:
            counts[bin_of(self.log_odds.flat[cell], self._parameters.limits)] += 1
        return counts


@kernel
def _observe(observed: ObservedCells, now, layers: HistogramLayers, parameters: WindowParameters):
    """Close the windows of cells last observed in an earlier one, add the evidence, update h.

    h = (sum_b p_b n_b + a p_0) / (n + a) with p_b = b / (B - 1): it stays the same as long as the
    open window falls into the same bin. Returns the cells whose h or centroid may have changed.
    """
    cells, hit = observed.cells, observed.hit
    window, log_odds, counts, occupied = layers
    limits, weight, prior = parameters.limits, parameters.weight, parameters.prior
    bins = counts.shape[1]
    changed, n = np.empty(len(cells), np.int64), 0
    for k in range(len(cells)):
        i = cells[k]
        before, new = log_odds[i], window[i] != now
        if new:
            if window[i] != NO_WINDOW:
                _count(counts, i, bin_of(before, limits))
            before, window[i] = parameters.start, now
        log_odds[i] = before + (parameters.hit if hit[k] else parameters.free)
        weighted = bin_of(log_odds[i], limits)
        moved = new or weighted != bin_of(before, limits)
        if moved or hit[k]:
            changed[n] = i
            n += 1
        if not moved:
            continue
        total = 1
        for b in range(bins):
            total += counts[i, b]
            weighted += b * np.int64(counts[i, b])
        occupied[i] = (weighted / (bins - 1) + weight * prior) / (total + weight)
    return changed[:n]


@kernel
def _count(counts, i, b):
    """Count a window in bin `b` of cell `i`; if the bin is full, halve all bins first."""
    if counts[i, b] == MAX_WINDOWS:
        for k in range(counts.shape[1]):
            counts[i, k] = (counts[i, k] + 1) // 2
    counts[i, b] += np.uint8(1)
