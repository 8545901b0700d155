"""Temporal map: every past window of every cell is kept (Mitsou and Tzafestas 2007)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.kernel import kernel
from slam.maps.log_odds import probability
from slam.maps.rays import ObservedCells
from slam.maps.tiles import AREA, GROWTH, Layer, Tiles
from slam.maps.windowed import Windowed, WindowParameters, bin_of
from slam.scan import Scan

NO_RECORD = -1  # in place of the record before a cell's first one


class TemporalLayers(NamedTuple):
    """The layers of a `Temporal`, flat: (cells,) each."""

    last: np.ndarray
    closed_windows: np.ndarray
    bin_sum: np.ndarray
    occupied: np.ndarray


class WindowRecords(NamedTuple):
    """One record per window and cell, as linked lists: arrays (records,) with spare room.

    previous  int64, number of the same cell's record before, or NO_RECORD
    window    int32, number of the window
    log_odds  float32, of the cell in that window
    """

    previous: np.ndarray
    window: np.ndarray
    log_odds: np.ndarray

    def grown(self, used: int, room: int) -> WindowRecords:
        """A copy of the first `used` records, with room for `room` of them."""
        return WindowRecords(*(_grown(array, used, room) for array in self))


class Temporal(Windowed):
    """Keeps the whole history, as in the paper's section 4.1; its memory grows with time.

    Windows of time as in `Histogram`, and exactly the same h as long as no bin of the histogram
    holds more than 255 windows, beyond which that one fades. Here each window of a cell takes 16
    more bytes, and the occupancy of a cell in any past window can be looked up. The records are not
    in the tiles: maps that share tiles (`Tiles.fork`) would write into each other's windows.

    resolution      m, side of a cell
    delta_t         s, length of a window
    bins            B, number of bins that the occupancy of a window is rounded to for h
    weight          a, the prior's weight in windows
    last            layer, int64, number of the record of the cell's open window
    closed_windows  layer, int32, number of closed windows
    bin_sum         layer, int32, sum of the bins of the closed windows
    """

    def _add_layers(self, tiles: Tiles) -> None:
        self.last = tiles.layer(np.int64, NO_RECORD)
        self.closed_windows = tiles.layer(np.int32)
        self.bin_sum = tiles.layer(np.int32)
        self._stored = 0
        self._records = WindowRecords(
            np.empty(0, np.int64), np.empty(0, np.int32), np.empty(0, np.float32)
        )

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles in use and of the history: it grows with time, not only with space."""
        record = sum(array.itemsize for array in self._records)
        return self.cells.tiles.nbytes + record * self._stored

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the open window of the observed cells."""
        observed = self.cells.trace(scan, pose)
        self._make_room(len(observed.cells))
        layers = TemporalLayers(
            self.last.flat,
            self.closed_windows.flat,
            self.bin_sum.flat,
            self.cells.occupied.flat,
        )
        self._stored = _observe(observed, self._clock.at(scan.time), layers, self._records,
                                self._stored, self._parameters)  # fmt: skip
        return observed.cells

    def history(self, row: int, col: int) -> tuple[np.ndarray, np.ndarray]:
        """The windows (n,) that observed a cell of the grid, and its occupancy (n,) in each.

        In the order in which they were opened. A clock that runs back opens a window again.
        """
        stored = []
        at = self.last.flat[self.cells.tiles.cell(row, col)]
        while at != NO_RECORD:
            stored.append(at)
            at = self._records.previous[at]
        stored.reverse()
        return self._records.window[stored], probability(self._records.log_odds[stored])

    def grid_of(self, window: int) -> OccupancyGrid:
        """The map of one window alone (equation 6); unobserved cells have the prior."""
        tiles = self.cells.tiles
        log_odds = Layer(np.float32, self.evidence.prior_log_odds, (AREA,), tiles.used)
        observed = Layer(np.bool_, False, (AREA,), tiles.used)
        last = self.last.flat[: tiles.used * AREA]
        _look_up(window, last, self._records, log_odds.flat, observed.flat)
        return OccupancyGrid(tiles.spec, probability(tiles.dense(log_odds)), tiles.dense(observed))

    def window_at(self, time: float) -> int:
        """Number of the window that `time` (s) lies in, counted from that of the first scan."""
        return self._clock.at(time)

    def _make_room(self, windows: int) -> None:
        """Reserve memory for `windows` more records."""
        needed, room = self._stored + windows, len(self._records.previous)
        if needed > room:
            self._records = self._records.grown(self._stored, max(needed, int(GROWTH * room)))


def _grown(array: np.ndarray, used: int, room: int) -> np.ndarray:
    result = np.empty(room, array.dtype)
    result[:used] = array[:used]
    return result


@kernel
def _observe(
    observed: ObservedCells,
    now,
    layers: TemporalLayers,
    records: WindowRecords,
    stored,
    parameters: WindowParameters,
):
    """Open a window for every cell last observed in another one, add the evidence, update h.

    `stored` of the records are in use; returns how many are afterwards.
    """
    cells, hit = observed.cells, observed.hit
    last, closed_windows, bin_sum, occupied = layers
    previous, window, log_odds = records
    limits, weight, prior = parameters.limits, parameters.weight, parameters.prior
    for k in range(len(cells)):
        i = cells[k]
        j = last[i]
        if j == NO_RECORD or window[j] != now:
            if j != NO_RECORD:
                closed_windows[i] += 1
                bin_sum[i] += bin_of(log_odds[j], limits)
            previous[stored], window[stored], log_odds[stored] = j, now, parameters.start
            last[i] = j = stored
            stored += 1
        log_odds[j] += parameters.hit if hit[k] else parameters.free
        windows = 1.0 + closed_windows[i]
        weighted = float(bin_sum[i] + bin_of(log_odds[j], limits))
        occupied[i] = (weighted / len(limits) + weight * prior) / (windows + weight)
    return stored


@kernel
def _look_up(asked, last, records: WindowRecords, result, observed):
    """Write the log-odds of all cells in window `asked`; of one opened twice, those of the later.

    result    (cells,) float32, log-odds; written where the window observed the cell
    observed  (cells,) bool; written likewise
    """
    previous, window, log_odds = records
    for i in range(len(last)):
        j = last[i]
        while j != NO_RECORD and window[j] != asked:
            j = previous[j]
        if j != NO_RECORD:
            result[i], observed[i] = log_odds[j], True
