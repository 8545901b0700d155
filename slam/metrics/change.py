"""Brier scores of h against the true share of time that a cell is occupied, and its state now.

Brier (1950). q is the share of the scans' times at which the cell is occupied. World frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.episode import Truth
from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid, grown
from slam.metrics.json_scores import Number, json_scores
from slam.metrics.raster import rasterise, times_touched

DOOR_SHARE = (0.02, 0.98)  # a cell with q between these is a door cell
BINS = 10  # equal bins of h for the calibration


class ChangeScores(NamedTuple):
    """Mean squared difference over the observed cells of a kind; NaN if the map has none.

    brier_share_*  between h and q, the true share of time that the cell is occupied
    brier_now_*    between h and the true state at the last scan (0 or 1)
    *_all, *_door, *_static  all cells, those with 0.02 < q < 0.98, and the others
    """

    brier_share_all: float
    brier_share_door: float
    brier_share_static: float
    brier_now_all: float
    brier_now_door: float
    brier_now_static: float

    def as_dict(self, suffix: str = "") -> dict[str, Number | None]:
        """Flat, for JSON; an undefined score is None."""
        return json_scores(self._asdict(), suffix)


class Calibration(NamedTuple):
    """Reliability diagram of h: mean h of each bin against the true share of time occupied.

    Observed cells by h, in ten equal bins; lists of ten, 0 if a bin is empty.

    cells     number of cells
    believed  mean h
    occupied  mean true share of time that the cells are occupied
    """

    cells: list[int]
    believed: list[float]
    occupied: list[float]

    def as_dict(self) -> dict[str, list[int] | list[float]]:
        """For JSON."""
        return self._asdict()


class TrueOccupancy:
    """True occupancy of the cells: q (`share`) and the state at the last scan (`now`).

    Built from all moments of an episode at once, or incrementally with `add`.
    """

    def __init__(self, truth: Truth, resolution: float = 0.05) -> None:
        ends = np.concatenate([truth.walls.reshape(-1, 2), truth.doors.reshape(-1, 2)])
        low, high = (ends.min(axis=0), ends.max(axis=0)) if len(ends) else (np.zeros(2),) * 2
        self.spec = GridSpec.around((low[0], low[1]), (high[0], high[1]), resolution)
        self._walls = rasterise(truth.walls, self.spec)
        self._touched, self._moments = np.zeros(self.spec.shape, dtype=np.int64), 0
        self.add(truth.doors)

    def add(self, doors: Array) -> None:
        """Add the `doors` (n, d, 4), m, at n >= 1 further moments."""
        self._cover(doors)
        self._touched += times_touched(doors, self.spec)
        self._moments += len(doors)
        self.share: Array = self._touched / self._moments
        self.share[self._walls] = 1.0
        self.now: np.ndarray = self._walls | rasterise(doors[-1], self.spec)

    def calibration(self, grid: OccupancyGrid) -> Calibration:
        """h of a map on the same lattice against the share of time (a reliability diagram)."""
        h, q, _ = self._observed(grid)
        number = np.minimum((h * BINS).astype(np.int64), BINS - 1)
        cells = np.bincount(number, minlength=BINS)
        believed, occupied = (
            np.bincount(number, values, minlength=BINS) / np.maximum(cells, 1) for values in (h, q)
        )
        return Calibration(cells.tolist(), believed.tolist(), occupied.tolist())

    def score(self, grid: OccupancyGrid) -> ChangeScores:
        """Brier scores of a map on the same lattice. Cells outside the truth's grid are free."""
        h, q, now = self._observed(grid)
        door = (q > DOOR_SHARE[0]) & (q < DOOR_SHARE[1])
        return ChangeScores(*_by_kind(h, q, door), *_by_kind(h, now, door))

    def _observed(self, grid: OccupancyGrid) -> tuple[Array, Array, Array]:
        """(cells,) h, q and the truth now of the observed cells."""
        if grid.spec.resolution != self.spec.resolution:
            raise InputError(
                f"the map's cells are {grid.spec.resolution} m, "
                f"but the truth was made for {self.spec.resolution} m"
            )
        observed = grid.observed
        h = grid.occupied[observed]
        q = _placed(self.share, self.spec, grid.spec)[observed]
        now = _placed(self.now.astype(np.float64), self.spec, grid.spec)[observed]
        return h, q, now

    def _cover(self, doors: Array) -> None:
        """Grow the grid to contain `doors`."""
        if not doors.size:
            return
        ends = doors.reshape(-1, 2)
        low, high = ends.min(axis=0), ends.max(axis=0)
        spec = self.spec.covering((low[0], low[1]), (high[0], high[1]))
        self._walls = grown(self._walls, self.spec, spec, False)
        self._touched = grown(self._touched, self.spec, spec, 0)
        self.spec = spec


def _by_kind(h: Array, target: Array, door: np.ndarray) -> tuple[float, float, float]:
    squared = (h - target) ** 2
    return _mean(squared), _mean(squared[door]), _mean(squared[~door])


def _mean(values: Array) -> float:
    return float(values.mean()) if len(values) else math.nan


def _placed(array: Array, of: GridSpec, on: GridSpec) -> Array:
    """`array` of grid `of` on the cells of grid `on`; 0 where `of` does not reach."""
    result = np.zeros(on.shape)
    row, col = of.row0 - on.row0, of.col0 - on.col0
    row0, row1 = max(row, 0), min(row + of.rows, on.rows)
    col0, col1 = max(col, 0), min(col + of.cols, on.cols)
    if row0 < row1 and col0 < col1:
        result[row0:row1, col0:col1] = array[row0 - row : row1 - row, col0 - col : col1 - col]
    return result
