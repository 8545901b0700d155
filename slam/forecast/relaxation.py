"""How fast what was seen loses its worth: the autocorrelation of a door about its weekly rate.

With the rates b0 at the look and b at the forecast, and v = sqrt(b (1 - b)),

    P(1 at t | s seen at t0) = b + (s - b0) rho(t - t0) v / v0.

This is exact for a process of two states with these rates and the correlation rho, whatever its
dwell times are. rho is learned for time lags of a minute to a day; lags in between are
interpolated. Where it is known for how long the state had lasted, rho depends on that too
(semi-Markov), and is the least squares fit shrunk to the common curve.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import isotonic_regression

from slam.geometry import Array

LAGS = np.array([1, 2, 3, 5, 8, 12, 18, 27, 40, 60, 90, 135, 200, 300, 450, 700, 1000, 1440])
# min, the smallest time lag of each bin; the first and the last time lags of a bin count alike
LAG_END, FORGOTTEN = 2160, 2880  # min: end of the last bin; from here on a look says nothing
AGES = np.array([0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512])  # min, the youngest of each bin
PRIOR_LOOKS = 1.0  # independent looks at a rate of one half, for the prior of rho
PRIOR_DECAY = 60.0  # min: the prior of rho is exp(-lag / PRIOR_DECAY)
AGE_PRIOR_LOOKS = 100.0  # independent looks, for the common curve in that of one age
MAX_GAIN = 3.0  # of v / v0: a look at a time when the door hardly ever is open says less than that
MIN_PROBABILITY = 5e-4


class Pairs(NamedTuple):
    """Pairs of a look and what was there a time lag later; arrays (n,).

    lag           index of the bin of the time lag
    seen, later   states, 0 or 1
    rate0, rate   weekly rates at both times
    age           index of the bin of the age of `seen`; -1: not known
    """

    lag: np.ndarray
    seen: np.ndarray
    later: np.ndarray
    rate0: Array
    rate: Array
    age: np.ndarray


class LagSums:
    """Sums over pairs, by the time lag, and by state and age of what was seen.

    common  (2, 18): of products of the residuals, and of v v0
    fit     (3, 18, 2, 11): of residual times effect, of squared effects, of weights
    """

    def __init__(self) -> None:
        self.common = np.zeros((2, len(LAGS)))
        self.fit = np.zeros((3, len(LAGS), 2, len(AGES)))

    def add(self, pairs: Pairs, weights: Array) -> None:
        """Count pairs (n,) with `weights` (n,)."""
        residual = pairs.later - pairs.rate
        product = residual * (pairs.seen - pairs.rate0)
        spread = _deviation(pairs.rate) * _deviation(pairs.rate0)
        for total, values in zip(self.common, (product, spread), strict=True):
            total += np.bincount(pairs.lag, weights * values, len(LAGS))
        effect = _effect(pairs.seen, pairs.rate0, pairs.rate)
        known, shape = pairs.age >= 0, self.fit.shape[1:]
        cell = np.ravel_multi_index(
            (pairs.lag[known], pairs.seen[known].astype(np.int64), pairs.age[known]), shape
        )
        for total, values in zip(self.fit, (residual * effect, effect**2, 1.0), strict=True):
            found = (weights * values)[known]
            total += np.bincount(cell, found, total.size).reshape(shape)

    def curves(self, scale: float) -> tuple[Array, Array]:
        """The common curve (18,), and (18, 2, 11) by state and age; the sums are multiplied by
        `scale`. None rises with the time lag, all are in [0, 1]."""
        product, spread = scale * self.common
        weight = 0.25 * PRIOR_LOOKS * LAGS
        common = _falling(
            (product + weight * np.exp(-LAGS / PRIOR_DECAY)) / (spread + weight), spread + weight
        )
        return common, _by_age(scale * self.fit, common)


def _by_age(fit: Array, common: Array) -> Array:
    """(18, 2, 11): looks less than a time lag apart are not independent, so that the weight of the
    common curve grows with the lag."""
    product, squares, count = fit
    mean = squares.sum(axis=(1, 2)) / np.maximum(count.sum(axis=(1, 2)), 1.0)
    weight = np.maximum(AGE_PRIOR_LOOKS * LAGS * mean, 1e-9)[:, None, None]
    curves = (product + weight * common[:, None, None]) / (squares + weight)
    for state, age in np.ndindex(curves.shape[1:]):
        curves[:, state, age] = _falling(curves[:, state, age], (squares + weight)[:, state, age])
    return curves


def forecast(rate: Array, rate0: Array, seen: Array, rho: Array) -> Array:
    """P(1 at t | seen), all of one shape."""
    probability = rate + rho * _effect(seen, rate0, rate)
    return np.clip(probability, MIN_PROBABILITY, 1.0 - MIN_PROBABILITY)


def interpolated(curves: Array, lag: Array) -> Array:
    """rho at time lags (n,) in min, linear in log(1 + lag); curves (18, n) or (18, 1). It is 1 at
    lag 0 and 0 from FORGOTTEN on."""
    knots = np.log1p(np.concatenate([[0], LAGS, [FORGOTTEN]]))
    ends = np.ones((1, curves.shape[1]))
    values = np.concatenate([ends, curves, 0.0 * ends])
    at = np.log1p(np.minimum(lag, FORGOTTEN))
    right = np.clip(np.searchsorted(knots, at, side="right"), 1, len(knots) - 1)
    share = (at - knots[right - 1]) / (knots[right] - knots[right - 1])
    column = np.arange(len(at)) if curves.shape[1] > 1 else np.zeros(len(at), np.int64)
    return (1.0 - share) * values[right - 1, column] + share * values[right, column]


def age_bin(age: np.ndarray) -> np.ndarray:
    """Index of the bin of ages in min (n,); -1 for a negative age, one that is not known."""
    return np.searchsorted(AGES, age, side="right") - 1


def _effect(seen: Array, rate0: Array, rate: Array) -> Array:
    gain = np.minimum(_deviation(rate) / _deviation(rate0), MAX_GAIN)
    return (seen - rate0) * gain


def _deviation(rate: Array) -> Array:
    return np.sqrt(rate * (1.0 - rate))


def _falling(values: Array, weights: Array) -> Array:
    fitted = isotonic_regression(values, weights=weights, increasing=False).x
    return np.clip(fitted, 0.0, 1.0)
