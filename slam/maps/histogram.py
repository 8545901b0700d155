"""Histogram map: how often a cell was how occupied, over windows of time (the paper, 4.2)."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.kernel import kernel
from slam.maps.tiles import AREA, Tiles
from slam.maps.windowed import Windowed, bin_of
from slam.scan import Scan

NEVER = np.iinfo(np.int32).min  # the window of a cell that nothing was seen of

MOST = 255  # windows that a bin can count: of 4 s, 17 minutes of being watched


class Histogram(Windowed):
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
    counts      layer of (B,) uint8, closed windows by their occupancy: the histogram. A bin that
                would count beyond 255 halves all bins of its cell: old windows fade
    """

    def _begin(self, tiles: Tiles) -> None:
        self.counts = tiles.layer(np.uint8, 0, (AREA, self.bins))
        self.log_odds = tiles.layer(np.float32, self.evidence.prior_log_odds)
        self.window = tiles.layer(np.int32, NEVER)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the open window of the cells that it saw."""
        seen = self.cells.see(scan, pose)
        return _observe(
            seen.cells,
            seen.hit,
            self._windows.at(scan.time),
            self.window.flat,
            self.log_odds.flat,
            self.counts.flat,
            self.cells.occupied.flat,
            self._limits,
            (self.evidence.hit, self.evidence.free, self.evidence.prior_log_odds),
            (self.weight, self.evidence.prior),
        )

    def histogram(self, row: int, col: int) -> np.ndarray:
        """(B,) number of windows by occupancy of one cell of the grid, the open one counted in."""
        cell = self.cells.tiles.cell(row, col)
        counts = self.counts.flat[cell].astype(np.int64)
        if self.window.flat[cell] != NEVER:
            counts[bin_of(self.log_odds.flat[cell], self._limits)] += 1
        return counts


@kernel
def _observe(cells, hit, now, window, log_odds, counts, occupied, limits, evidence, belief):
    """Close the windows of cells last seen in an earlier one, add the evidence, and give h.

    h = (sum_b p_b n_b + a p_0) / (n + a) with p_b = b / (B - 1): it stays as long as the open
    window falls into the same bin. The result are the cells whose h or centroid may have changed.
    """
    hit_evidence, free_evidence, start = evidence
    weight, prior = belief
    bins = counts.shape[1]
    changed, n = np.empty(len(cells), np.int64), 0
    for k in range(len(cells)):
        i = cells[k]
        before, new = log_odds[i], window[i] != now
        if new:
            if window[i] != NEVER:
                _count(counts, i, bin_of(before, limits))
            before, window[i] = start, now
        log_odds[i] = before + (hit_evidence if hit[k] else free_evidence)
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
    """One window more; where a bin is full, all that was counted so far counts half."""
    if counts[i, b] == MOST:
        for k in range(counts.shape[1]):
            counts[i, k] = (counts[i, k] + 1) // 2
    counts[i, b] += np.uint8(1)
