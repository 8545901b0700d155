"""Temporal map: every past window of every cell, none forgotten (Mitsou and Tzafestas 2007)."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.kernel import kernel
from slam.maps.log_odds import probability
from slam.maps.tiles import AREA, GROWTH, Layer, Tiles
from slam.maps.windowed import Windowed, bin_of
from slam.scan import Scan

NONE = -1  # before the first window of a cell


class Temporal(Windowed):
    """Keeps the whole history, as the paper's section 4.1 has it; its memory grows with time.

    Windows of time as in `Histogram`, and the same h: exactly, as long as no bin of the histogram
    holds more than 255 windows, from where on that one fades. Here each window of a cell takes 16
    more bytes, and what a cell was in any past window can be asked. The store is not in the tiles:
    maps that share them (`Tiles.fork`) would write into each other's windows.

    resolution  m, side of a cell
    delta_t     s, length of a window
    bins        B, to which the occupancy of a window is rounded for h
    weight      a, how many windows the prior is worth
    last        layer, number of the cell's latest window in the store, which is the open one
    closed      layer, windows before that
    total       layer, sum of their bins
    """

    def _begin(self, tiles: Tiles) -> None:
        self.last = tiles.layer(np.int64, NONE)
        self.closed = tiles.layer(np.int32)
        self.total = tiles.layer(np.int32)
        self._stored = 0
        self._previous = np.empty(0, np.int64)
        self._window = np.empty(0, np.int32)
        self._log_odds = np.empty(0, np.float32)

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles in use and of the history: it grows with time, not only with space."""
        one = self._previous.itemsize + self._window.itemsize + self._log_odds.itemsize
        return self.cells.tiles.nbytes + one * self._stored

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the open window of the cells that it saw."""
        seen = self.cells.see(scan, pose)
        self._make_room(len(seen.cells))
        self._stored = _observe(
            seen.cells,
            seen.hit,
            self._windows.at(scan.time),
            self.last.flat,
            self.closed.flat,
            self.total.flat,
            self.cells.occupied.flat,
            self._previous,
            self._window,
            self._log_odds,
            self._stored,
            self._limits,
            self.evidence.hit,
            self.evidence.free,
            self.evidence.prior_log_odds,
            self.weight,
            self.evidence.prior,
        )
        return seen.cells

    def history(self, row: int, col: int) -> tuple[np.ndarray, np.ndarray]:
        """The windows (n,) that saw a cell of the grid, and its occupancy (n,) in each of them.

        In the order in which they were opened. A clock that runs back opens a window again.
        """
        stored = []
        at = self.last.flat[self.cells.tiles.cell(row, col)]
        while at != NONE:
            stored.append(at)
            at = self._previous[at]
        stored.reverse()
        return self._window[stored], probability(self._log_odds[stored])

    def grid_of(self, window: int) -> OccupancyGrid:
        """The map of one window alone (equation 6); what it did not see has the prior."""
        tiles = self.cells.tiles
        log_odds = Layer(np.float32, self.evidence.prior_log_odds, (AREA,))
        observed = Layer(np.bool_, False, (AREA,))
        log_odds.hold(tiles.used)
        observed.hold(tiles.used)
        _look_up(window, self.last.flat[: tiles.used * AREA], self._previous, self._window,
                 self._log_odds, log_odds.flat, observed.flat)  # fmt: skip
        return OccupancyGrid(tiles.spec, probability(tiles.dense(log_odds)), tiles.dense(observed))

    def window_at(self, time: float) -> int:
        """Number of the window of `time` (s), counted from that of the first scan."""
        return self._windows.at(time)

    def _make_room(self, windows: int) -> None:
        """Let the store hold so many more."""
        needed = self._stored + windows
        if needed > len(self._previous):
            room = max(needed, int(GROWTH * len(self._previous)))
            self._previous = _larger(self._previous, self._stored, room)
            self._window = _larger(self._window, self._stored, room)
            self._log_odds = _larger(self._log_odds, self._stored, room)


def _larger(array: np.ndarray, used: int, room: int) -> np.ndarray:
    result = np.empty(room, array.dtype)
    result[:used] = array[:used]
    return result


@kernel
def _observe(
    cells, hit, now, last, closed, total, occupied, previous, window, log_odds, stored, limits,
    hit_evidence, free_evidence, start, weight, prior,
):  # fmt: skip
    """Open a window of every cell last seen in another one, add the evidence, and give h.

    `previous`, `window` and `log_odds` are the store, of which `stored` are in use; gives how many
    are then.
    """
    for k in range(len(cells)):
        i = cells[k]
        j = last[i]
        if j == NONE or window[j] != now:
            if j != NONE:
                closed[i] += 1
                total[i] += bin_of(log_odds[j], limits)
            previous[stored], window[stored], log_odds[stored] = j, now, start
            last[i] = j = stored
            stored += 1
        log_odds[j] += hit_evidence if hit[k] else free_evidence
        windows, weighted = 1.0 + closed[i], float(total[i] + bin_of(log_odds[j], limits))
        occupied[i] = (weighted / len(limits) + weight * prior) / (windows + weight)
    return stored


@kernel
def _look_up(asked, last, previous, window, log_odds, result, observed):
    """The log-odds of all cells in one window; of a window opened twice, the later one's."""
    for i in range(len(last)):
        j = last[i]
        while j != NONE and window[j] != asked:
            j = previous[j]
        if j != NONE:
            result[i], observed[i] = log_odds[j], True
