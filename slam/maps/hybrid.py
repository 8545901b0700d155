"""Hybrid map: a static map that does not forget objects that come back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Pose2
from slam.kernel import kernel
from slam.maps.rays import ObservedCells
from slam.maps.tiles import Tiles
from slam.maps.windowed import MAX_WINDOWS, NO_WINDOW, Windowed, WindowParameters, bin_of
from slam.scan import Scan

MIN_OCCUPIED_WINDOWS = 2  # windows in which a cell was occupied, from which on h uses the mean


class HybridLayers(NamedTuple):
    """The layers of a `Hybrid`, flat: (cells,) each."""

    log_odds: np.ndarray
    window_log_odds: np.ndarray
    window: np.ndarray
    closed_windows: np.ndarray
    occupied_windows: np.ndarray
    bin_sum: np.ndarray
    occupied: np.ndarray


class Hybrid(Windowed):
    """h is the static map's, or the histogram's if that is larger and the cell was occupied twice.

    Our own: the static map is sharp where nothing changes, and the histogram remembers a door that
    is open at the moment. An object seen in one window only, such as a passer-by, is in the static
    map alone, which forgets it. Of the histogram only what its mean needs is kept.

    resolution        m, side of a cell
    delta_t           s, length of a window
    bins              B, number of bins that the occupancy of a window is rounded to for the mean
    weight            a, the prior's weight in windows
    log_odds          layer, float32, static
    window_log_odds   layer, float32, log-odds of the open window
    window            layer, int32, number of the open window
    closed_windows    layer, uint8, number of closed windows; beyond 255 all counts are halved
    occupied_windows  layer, uint8, number of closed windows in which the cell was occupied
    bin_sum           layer, uint16, sum of the bins of the closed windows
    """

    def _add_layers(self, tiles: Tiles) -> None:
        self.log_odds = tiles.layer(np.float32, self.evidence.prior_log_odds)
        self.window_log_odds = tiles.layer(np.float32, self.evidence.prior_log_odds)
        self.window = tiles.layer(np.int32, NO_WINDOW)
        self.closed_windows = tiles.layer(np.uint8)
        self.occupied_windows = tiles.layer(np.uint8)
        self.bin_sum = tiles.layer(np.uint16)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the static log-odds and to the open windows of its cells."""
        observed = self.cells.trace(scan, pose)
        layers = HybridLayers(
            self.log_odds.flat,
            self.window_log_odds.flat,
            self.window.flat,
            self.closed_windows.flat,
            self.occupied_windows.flat,
            self.bin_sum.flat,
            self.cells.occupied.flat,
        )
        _observe(observed, self._clock.at(scan.time), layers, self._parameters)
        return observed.cells


@kernel
def _observe(observed: ObservedCells, now, layers: HybridLayers, parameters: WindowParameters):
    """Close the windows of cells last observed in another one, add the evidence, update h."""
    cells, hit = observed.cells, observed.hit
    log_odds, window_log_odds, window = layers.log_odds, layers.window_log_odds, layers.window
    closed_windows, occupied_windows = layers.closed_windows, layers.occupied_windows
    bin_sum, occupied = layers.bin_sum, layers.occupied
    limits, weight, prior = parameters.limits, parameters.weight, parameters.prior
    for k in range(len(cells)):
        i = cells[k]
        if window[i] != now:
            if window[i] != NO_WINDOW:
                _close(layers, i, window_log_odds[i], bin_of(window_log_odds[i], limits))
            window_log_odds[i], window[i] = parameters.start, now
        evidence = parameters.hit if hit[k] else parameters.free
        log_odds[i] += evidence
        window_log_odds[i] += evidence
        h = 1.0 / (1.0 + np.exp(-log_odds[i]))
        if occupied_windows[i] + (window_log_odds[i] > 0.0) >= MIN_OCCUPIED_WINDOWS:
            weighted = float(bin_sum[i] + bin_of(window_log_odds[i], limits))
            mean = (weighted / len(limits) + weight * prior) / (1.0 + closed_windows[i] + weight)
            h = max(h, mean)
        occupied[i] = h


@kernel
def _close(layers: HybridLayers, i, log_odds, b):
    """Count the open window of cell `i`; if the counts are full, halve them first."""
    closed_windows, occupied_windows = layers.closed_windows, layers.occupied_windows
    bin_sum = layers.bin_sum
    if closed_windows[i] == MAX_WINDOWS:
        closed_windows[i] = (closed_windows[i] + 1) // 2
        occupied_windows[i] = (occupied_windows[i] + 1) // 2
        bin_sum[i] = (bin_sum[i] + 1) // 2
    closed_windows[i] += np.uint8(1)
    occupied_windows[i] += np.uint8(log_odds > 0.0)
    bin_sum[i] += np.uint16(b)
