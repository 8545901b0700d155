"""Mean map: of the histogram only what h needs, for a SLAM that keeps many maps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Pose2
from slam.kernel import kernel
from slam.maps.rays import ObservedCells
from slam.maps.tiles import Tiles
from slam.maps.windowed import MAX_WINDOWS, Windowed, WindowParameters, bin_of
from slam.scan import Scan

NO_NUMBER = 0  # window number of a cell that was never observed
WINDOW_NUMBERS = 65535  # the numbers repeat after so many windows: of 4 s each, three days


class MeanLayers(NamedTuple):
    """The layers of a `Mean`, flat: (cells,) each."""

    window: np.ndarray
    log_odds: np.ndarray
    closed_windows: np.ndarray
    bin_sum: np.ndarray
    occupied: np.ndarray


class Mean(Windowed):
    """Has the h of `Histogram`, in 9 bytes per cell instead of 18.

    h is exactly the same as long as a cell was observed in at most 255 windows. Beyond, all of them
    fade together; in `Histogram` they fade bin by bin. The histogram itself is not kept.

    resolution      m, side of a cell
    delta_t         s, length of a window
    bins            B, number of bins that the occupancy of a window is rounded to
    weight          a, the prior's weight in windows
    log_odds        layer, float32, of the open window
    window          layer, uint16, number of the open window, from 1 on
    closed_windows  layer, uint8, number of closed windows
    bin_sum         layer, uint16, sum of the bins of the closed windows
    """

    def _add_layers(self, tiles: Tiles) -> None:
        self.log_odds = tiles.layer(np.float32, self.evidence.prior_log_odds)
        self.window = tiles.layer(np.uint16, NO_NUMBER)
        self.closed_windows = tiles.layer(np.uint8)
        self.bin_sum = tiles.layer(np.uint16)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the open window of the observed cells."""
        observed = self.cells.trace(scan, pose)
        layers = MeanLayers(
            self.window.flat,
            self.log_odds.flat,
            self.closed_windows.flat,
            self.bin_sum.flat,
            self.cells.occupied.flat,
        )
        now = self._clock.at(scan.time) % WINDOW_NUMBERS + 1
        return _observe(observed, now, layers, self._parameters)


@kernel
def _observe(observed: ObservedCells, now, layers: MeanLayers, parameters: WindowParameters):
    """Close the windows of cells last observed in another one, add the evidence, update h.

    Returns the cells whose h or centroid may have changed.
    """
    cells, hit = observed.cells, observed.hit
    window, log_odds, closed_windows, bin_sum, occupied = layers
    limits, weight, prior = parameters.limits, parameters.weight, parameters.prior
    changed, n = np.empty(len(cells), np.int64), 0
    for k in range(len(cells)):
        i = np.uint64(cells[k])
        before, new = log_odds[i], window[i] != now
        if new:
            if window[i] != NO_NUMBER:
                _close(closed_windows, bin_sum, i, bin_of(before, limits))
            before, window[i] = parameters.start, now
        log_odds[i] = before + (parameters.hit if hit[k] else parameters.free)
        occupancy = bin_of(log_odds[i], limits)
        moved = new or occupancy != bin_of(before, limits)
        if moved:
            weighted, windows = np.int64(bin_sum[i]) + occupancy, np.int64(closed_windows[i]) + 1
            occupied[i] = (weighted / len(limits) + weight * prior) / (windows + weight)
        if moved or hit[k]:
            changed[n] = cells[k]
            n += 1
    return changed[:n]


@kernel
def _close(closed_windows, bin_sum, i, b):
    """Count the open window of cell `i`, in bin `b`; if the counts are full, halve them first."""
    if closed_windows[i] == MAX_WINDOWS:
        closed_windows[i] = (closed_windows[i] + 1) // 2
        bin_sum[i] = (bin_sum[i] + 1) // 2
    closed_windows[i] += np.uint8(1)
    bin_sum[i] += np.uint16(b)
