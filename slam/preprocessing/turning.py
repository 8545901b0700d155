"""The turning of a robot by its laser and by its odometry, compared at stamps that are moved.

The laser's turning from scan to scan (`scan_rotation`) is fitted by a multiple of the odometry's,
and a drift with way and time, for every offset between their stamps. Where a robot starts to turn,
a wrong offset shows; where it drives straight or turns evenly, it does not.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from slam.geometry import Array
from slam.trajectory import Trajectory

MAX_OFFSET = 0.6  # s, either way, of the offsets that are compared
GRID_STEP = 0.01  # s between them
RATE_SPAN = 0.05  # s, either side, over which the slope of the turning by the offset is measured
SMOOTHING = 1.0  # standard deviation of the smoothing, in steps of the scans or the odometry
SMOOTHING_REACH = 3.0  # standard deviations
FIRST_SPREAD = math.radians(0.5)  # scale of the Cauchy loss, rad, until that of the residuals
SPREAD_PER_MEDIAN = 1.5  # that scale, as a multiple of the median residual
MIN_SPREAD = math.radians(0.05)  # rad; a smaller scale is by chance
REWEIGHTINGS = 6
DAMPING = 1e-9  # by the trace of the normal matrix
BLOCK = 20  # pairs of scans, one after another, whose errors may depend on each other
SYSTEMATIC = 0.005  # s: error that stayed on simulated drives of known offset, however many turns


class TurningFit(NamedTuple):
    """A weighted fit at one offset, of n smoothed pairs of scans.

    factors    (3,) of rad turned and m driven by the odometry, and of s
    moved      (n, 3) rad, m, s
    residuals  (n,) rad
    weights    (n,) of the Cauchy loss
    """

    factors: Array
    moved: Array
    residuals: Array
    weights: Array


class TurningProfile:
    """How well the turning of laser and odometry agree, by the offset.

    offsets  (m,) s, added to the laser's stamps
    costs    (m,) mean Cauchy loss
    """

    def __init__(self, odometry: Trajectory, stamps: Array, turned: Array):
        """stamps (n, 2) s, increasing, and turned (n,) rad by the laser: of pairs of scans."""
        self._times, self._ways = odometry.times, _ways(odometry)
        self._stamps, self._turned = stamps, turned
        self._smooth = _smoothing(stamps.mean(axis=1), SMOOTHING * _longest_step(stamps, odometry))
        self.offsets = np.linspace(-1, 1, round(2 * MAX_OFFSET / GRID_STEP) + 1) * MAX_OFFSET
        self._spread = FIRST_SPREAD
        for _ in range(2):
            self.costs = np.array([self._cost(offset) for offset in self.offsets])
            residuals = self.fit(self.offsets[int(np.argmin(self.costs))]).residuals
            self._spread = max(SPREAD_PER_MEDIAN * float(np.median(np.abs(residuals))), MIN_SPREAD)

    def best(self) -> float:
        """The offset of the smallest cost, s; NaN where that is the first or the last one."""
        at = int(np.argmin(self.costs))
        if not 0 < at < len(self.costs) - 1:
            return math.nan
        return float(self.offsets[at]) + GRID_STEP * _lowest(self.costs[at - 1 : at + 2])

    def fit(self, offset: float) -> TurningFit:
        """The fit at an offset, by iteratively reweighted least squares."""
        turned, moved = self._smooth @ self._turned, self._smooth @ self._moved(offset)
        fit = _fitted(turned, moved, np.ones(len(moved)))
        for _ in range(REWEIGHTINGS):
            fit = _fitted(turned, moved, 1 / (1 + (fit.residuals / self._spread) ** 2))
        return fit

    def explained(self, fit: TurningFit) -> float:
        """Share of the laser's turning that the odometry's explains, beyond drift; 0 where
        one of the two does not turn."""
        turned = fit.moved @ fit.factors + fit.residuals
        drift = _fitted(turned, fit.moved * (0, 1, 1), fit.weights)
        without = fit.weights @ drift.residuals**2
        if not (without > 0 and fit.factors[0] > 0):
            return 0.0
        return 1 - float(fit.weights @ fit.residuals**2 / without)

    def deviation(self, offset: float, fit: TurningFit) -> float:
        """Standard error of the offset, s: of errors that are independent before the smoothing,
        each as large as its residual there (White's estimator), or dependent within blocks,
        whichever is larger, and `SYSTEMATIC`."""
        later, earlier = (self._moved(offset + step) for step in (RATE_SPAN, -RATE_SPAN))
        slope = self._smooth @ ((later - earlier) @ fit.factors / (2 * RATE_SPAN))
        slope -= fit.moved @ np.linalg.lstsq(fit.moved, slope)[0]  # what no factor can imitate
        pull = fit.weights * slope
        curvature = float(pull @ slope)
        if not curvature > 0:
            return math.inf
        single = (self._smooth.T @ pull) * (self._turned - self._moved(offset) @ fit.factors)
        blocks = np.add.reduceat(pull * fit.residuals, np.arange(0, len(slope), BLOCK))
        scatter = math.sqrt(max((single**2).sum(), (blocks**2).sum())) / curvature
        return math.hypot(scatter, SYSTEMATIC)

    def _cost(self, offset: float) -> float:
        return float(np.log1p((self.fit(offset).residuals / self._spread) ** 2).mean())

    def _moved(self, offset: float) -> Array:
        """(n, 3) from scan to scan by the odometry: rad turned, m driven, s."""
        stamps = self._stamps + offset
        turned, driven = (
            np.diff(np.interp(stamps, self._times, way))[:, 0] for way in self._ways.T
        )
        return np.column_stack([turned, driven, np.diff(self._stamps)[:, 0]])


def _fitted(turned: Array, moved: Array, weights: Array) -> TurningFit:
    squares = (moved.T * weights) @ moved
    squares += (DAMPING * np.trace(squares) + math.ulp(1.0)) * np.eye(3)
    factors = np.linalg.solve(squares, moved.T @ (weights * turned))
    return TurningFit(factors, moved, turned - moved @ factors, weights)


def _ways(odometry: Trajectory) -> Array:
    """(n, 2) rad turned and m driven up to each pose."""
    steps = np.diff(odometry.poses[:, :2], axis=0)
    driven = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
    return np.column_stack([np.unwrap(odometry.poses[:, 2]), driven])


def _longest_step(stamps: Array, odometry: Trajectory) -> float:
    """s, the usual step of the scans or that of the odometry, whichever is longer."""
    steps = np.diff(odometry.times)
    return max(float(np.median(np.diff(stamps))), float(np.median(steps)) if len(steps) else 0.0)


def _smoothing(times: Array, width: float) -> csr_array:
    """(n, n) weighted mean of neighbours in time, with Gaussian weights of standard deviation
    `width` (s).

    Odometry between two of its poses is less noisy than at one, since it is interpolated; offsets
    halfway between poses would fit better than the true one. Smoothing, of laser and odometry
    alike, takes away the frequencies at which they differ.
    """
    reach = SMOOTHING_REACH * width
    first, end = np.searchsorted(times, times - reach), np.searchsorted(times, times + reach)
    rows = np.repeat(np.arange(len(times)), end - first)
    columns = np.concatenate([np.arange(a, b) for a, b in zip(first, end, strict=True)])
    weights = np.exp(-0.5 * ((times[rows] - times[columns]) / width) ** 2)
    weights /= np.bincount(rows, weights)[rows]
    return csr_array((weights, (rows, columns)), shape=(len(times), len(times)))


def _lowest(costs: Array) -> float:
    """Where, in grid steps from the middle of three costs, a parabola through them is lowest."""
    before, least, after = costs.tolist()
    bend = before - 2 * least + after
    return 0.5 * (before - after) / bend if bend > 0 else 0.0
