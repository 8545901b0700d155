"""Hybrid map: a static map that does not forget what comes back."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.kernel import kernel
from slam.maps.tiles import Tiles
from slam.maps.windowed import Windowed, bin_of
from slam.scan import Scan

NEVER = np.iinfo(np.int32).min  # the window of a cell that nothing was seen of
MOST = 255  # windows that are counted
RETURNS = 2  # windows in which a cell was occupied, from where on it is one that comes back


class Hybrid(Windowed):
    """h is the static map's, or the histogram's where that is more and the cell was occupied twice.

    Ours: the static map is sharp where nothing changes, and the histogram remembers a door that is
    away just now. What was there in one window only, somebody who passed, is the static map's
    alone, which forgets it. Of the histogram only what its mean needs is kept.

    resolution  m, side of a cell
    delta_t     s, length of a window
    bins        B, to which the occupancy of a window is rounded for the mean
    weight      a, how many windows the prior is worth
    log_odds    layer, float32, static
    current     layer, float32, log-odds of the open window
    window      layer, int32, its number
    closed      layer, uint8, windows before that; beyond 255 all count half
    risen       layer, uint8, those of them in which the cell was occupied
    total       layer, uint16, sum of their bins
    """

    def _begin(self, tiles: Tiles) -> None:
        self.log_odds = tiles.layer(np.float32, self.evidence.prior_log_odds)
        self.current = tiles.layer(np.float32, self.evidence.prior_log_odds)
        self.window = tiles.layer(np.int32, NEVER)
        self.closed = tiles.layer(np.uint8)
        self.risen = tiles.layer(np.uint8)
        self.total = tiles.layer(np.uint16)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the cells' sums and to their open windows."""
        seen = self.cells.see(scan, pose)
        _observe(
            seen.cells,
            seen.hit,
            self._windows.at(scan.time),
            self.log_odds.flat,
            self.current.flat,
            self.window.flat,
            self.closed.flat,
            self.risen.flat,
            self.total.flat,
            self.cells.occupied.flat,
            self._limits,
            self.evidence.hit,
            self.evidence.free,
            self.evidence.prior_log_odds,
            self.weight,
            self.evidence.prior,
        )
        return seen.cells


@kernel
def _observe(
    cells, hit, now, log_odds, current, window, closed, risen, total, occupied, limits,
    hit_evidence, free_evidence, start, weight, prior,
):  # fmt: skip
    """Close the windows of cells last seen in another one, add the evidence, and give h."""
    for k in range(len(cells)):
        i = cells[k]
        if window[i] != now:
            if window[i] != NEVER:
                _close(closed, risen, total, i, current[i], bin_of(current[i], limits))
            current[i], window[i] = start, now
        evidence = hit_evidence if hit[k] else free_evidence
        log_odds[i] += evidence
        current[i] += evidence
        h = 1.0 / (1.0 + np.exp(-log_odds[i]))
        if risen[i] + (current[i] > 0.0) >= RETURNS:
            weighted = float(total[i] + bin_of(current[i], limits))
            mean = (weighted / len(limits) + weight * prior) / (1.0 + closed[i] + weight)
            h = max(h, mean)
        occupied[i] = h


@kernel
def _close(closed, risen, total, i, log_odds, b):
    """One window more; where they are full, all that was counted so far counts half."""
    if closed[i] == MOST:
        closed[i] = (closed[i] + 1) // 2
        risen[i] = (risen[i] + 1) // 2
        total[i] = (total[i] + 1) // 2
    closed[i] += np.uint8(1)
    risen[i] += np.uint8(log_odds > 0.0)
    total[i] += np.uint16(b)
