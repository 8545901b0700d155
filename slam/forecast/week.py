"""The rate of state 1 by the time of the week, from counts that are slowly forgotten.

Watched and open minutes are counted in bins of ten minutes of the week and smoothed by a circular
Gaussian kernel. Few data are completed by a prior: the rate of the time of day, times a factor of
the weekday (observed over expected, as in indirect standardisation).
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from slam.forecast.clock import WEEK_MINUTES
from slam.geometry import Array

BIN = 10  # min
DAYS, DAY_BINS = 7, 144
SMOOTHING = 20.0  # min, standard deviation of the kernel
PRIOR_WEEKS = 16.0  # weight of the prior of a bin of the week, in weeks
PRIOR_DAYS = 3.0  # weight of the mean rate, in the rate of a time of day, in days
PRIOR_WATCH = 60.0  # min, weight of a rate of one half, and of a weekday factor of one
WEEKDAY_SHARE, MAX_INCREASE = 0.6, 2.0  # of a weekday factor's distance from one; times a factor
MAX_PRIOR, MIN_RATE = 0.95, 1e-3


class WeekCounts:
    """Minutes of one door by the time of the week.

    watched, open  (7, 144) weighted minutes, Monday first
    """

    def __init__(self) -> None:
        self.watched = np.zeros((DAYS, DAY_BINS))
        self.open = np.zeros((DAYS, DAY_BINS))

    def add(self, minutes: np.ndarray, state: np.ndarray, weights: Array) -> None:
        """Count looks at minutes of the week (n,), that saw `state` (n,), 0 or 1."""
        bins = minutes // BIN
        size = DAYS * DAY_BINS
        self.watched += np.bincount(bins, weights, size).reshape(DAYS, DAY_BINS)
        self.open += np.bincount(bins, weights * state, size).reshape(DAYS, DAY_BINS)

    def rates(self, scale: float) -> Array:
        """(1008,) rate of state 1 in each bin of the week; the counts are multiplied by `scale`."""
        watched, opened = scale * self.watched, scale * self.open
        prior = _prior(watched, opened)
        weight = PRIOR_WEEKS * BIN
        rate = (_smooth(opened.ravel()) + weight * prior.ravel()) / (
            _smooth(watched.ravel()) + weight
        )
        return np.clip(rate, MIN_RATE, 1.0 - MIN_RATE)


def at_minutes(rates: Array, minutes: np.ndarray) -> Array:
    """The rate at minutes of the week (any shape)."""
    return rates[(minutes % WEEK_MINUTES) // BIN]


def _prior(watched: Array, opened: Array) -> Array:
    """(7, 144): the rate of the time of day, times a factor of the weekday."""
    mean = (opened.sum() + 0.5 * PRIOR_WATCH) / (watched.sum() + PRIOR_WATCH)
    weight = PRIOR_DAYS * BIN
    by_time = (_smooth(opened.sum(0)) + weight * mean) / (_smooth(watched.sum(0)) + weight)
    expected = (watched * by_time).sum(axis=1)
    few = mean * PRIOR_WATCH
    factor = _tempered((opened.sum(axis=1) + few) / (expected + few))
    return np.minimum(factor[:, None] * by_time, MAX_PRIOR)


def _tempered(factor: Array) -> Array:
    """Weekday factors drawn towards one, since weekdays differ less in later weeks than in those
    learned from; but a day off stays one."""
    return np.minimum(1.0 + WEEKDAY_SHARE * (factor - 1.0), MAX_INCREASE * factor)


def _smooth(values: Array) -> Array:
    return gaussian_filter1d(values, SMOOTHING / BIN, mode="wrap")
