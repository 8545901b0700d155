"""Mean map: of the histogram only what h needs, for a SLAM that holds many maps."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.kernel import kernel
from slam.maps.tiles import Tiles
from slam.maps.windowed import Windowed, bin_of
from slam.scan import Scan

NEVER = 0  # the window of a cell that nothing was seen of
ROUND = 65535  # windows after which their numbers begin anew: of 4 s, three days
MOST = 255  # windows that are counted


class Mean(Windowed):
    """Matches against the h of `Histogram`, and keeps per cell 9 bytes of it instead of 18.

    The same h exactly, as long as a cell was seen in no more than 255 windows, from where on all of
    them fade; there they do bin by bin. How often a cell was how occupied cannot be asked.

    resolution  m, side of a cell
    delta_t     s, length of a window
    bins        B, to which the occupancy of a window is rounded
    weight      a, how many windows the prior is worth
    log_odds    layer, float32, of the open window
    window      layer, uint16, its number, from 1 on
    closed      layer, uint8, windows before that
    total       layer, uint16, sum of their bins
    """

    def _begin(self, tiles: Tiles) -> None:
        self.log_odds = tiles.layer(np.float32, self.evidence.prior_log_odds)
        self.window = tiles.layer(np.uint16, NEVER)
        self.closed = tiles.layer(np.uint8)
        self.total = tiles.layer(np.uint16)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the open window of the cells that it saw."""
        seen = self.cells.see(scan, pose)
        return _observe(
            seen.cells,
            seen.hit,
            self._windows.at(scan.time) % ROUND + 1,
            self.window.flat,
            self.log_odds.flat,
            self.closed.flat,
            self.total.flat,
            self.cells.occupied.flat,
            self._limits,
            (self.evidence.hit, self.evidence.free, self.evidence.prior_log_odds),
            (self.weight, self.evidence.prior),
        )


@kernel
def _observe(cells, hit, now, window, log_odds, closed, total, occupied, limits, evidence, belief):
    """Close the windows of cells last seen in another one, add the evidence, and give h.

    The result are the cells whose h or centroid may have changed.
    """
    hit_evidence, free_evidence, start = evidence
    weight, prior = belief
    changed, n = np.empty(len(cells), np.int64), 0
    for k in range(len(cells)):
        i = np.uint64(cells[k])
        before, new = log_odds[i], window[i] != now
        if new:
            if window[i] != NEVER:
                _close(closed, total, i, bin_of(before, limits))
            before, window[i] = start, now
        log_odds[i] = before + (hit_evidence if hit[k] else free_evidence)
        occupancy = bin_of(log_odds[i], limits)
        moved = new or occupancy != bin_of(before, limits)
        if moved:
            weighted, windows = np.int64(total[i]) + occupancy, np.int64(closed[i]) + 1
            occupied[i] = (weighted / len(limits) + weight * prior) / (windows + weight)
        if moved or hit[k]:
            changed[n] = cells[k]
            n += 1
    return changed[:n]


@kernel
def _close(closed, total, i, b):
    """One window more; where they are full, all that was counted so far counts half."""
    if closed[i] == MOST:
        closed[i] = (closed[i] + 1) // 2
        total[i] = (total[i] + 1) // 2
    closed[i] += np.uint8(1)
    total[i] += np.uint16(b)
