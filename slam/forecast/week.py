"""The rate of state 1 by the time of the week, from counts that are slowly forgotten.

Watched and open minutes are counted in bins of ten minutes of the week and smoothed by a circular
Gaussian kernel. Few data are completed by a prior: the rate of the time of day, times a factor of
the weekday (observed over expected, as in indirect standardisation).

How far a door's weekdays are to be trusted differs from door to door. Three settings forecast each
day before it is learned, and are averaged with weights that fall exponentially with their squared
error (aggregation of experts; Vovk 1990).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from slam.forecast.clock import WEEK_MINUTES
from slam.geometry import Array

BIN = 10  # min
DAYS, DAY_BINS = 7, 144
PRIOR_DAYS = 3.0  # weight of the mean rate, in the rate of a time of day, in days
PRIOR_WATCH = 60.0  # min, weight of a rate of one half, and of a weekday factor of one
MAX_FACTOR = 2.0  # of a weekday factor that is drawn towards one: a day off stays one
MAX_PRIOR, MIN_RATE = 0.98, 1e-3
INDEPENDENT = 60.0  # min between looks whose errors are about independent
LEARNING_RATE = 2.0  # of the squared errors; the largest for which averaging loses little


class Setting(NamedTuple):
    """How the rates of a week are estimated.

    smoothing      min, standard deviation of the kernel
    prior_weeks    weight of the prior of a bin, in weeks
    weekday_share  share of a weekday factor's distance from one
    """

    smoothing: float
    prior_weeks: float
    weekday_share: float


SETTINGS = (Setting(20.0, 16.0, 0.6), Setting(20.0, 4.0, 1.0), Setting(10.0, 0.25, 1.0))
PRIOR_WEIGHTS = np.array([1.0, 0.05, 0.05])  # what fits the next day best fits later weeks less


class WeekCounts:
    """Minutes of one door by the time of the week.

    watched, open  (7, 144) weighted minutes, Monday first
    errors         (3,) sums of the weighted squared errors of the SETTINGS
    """

    def __init__(self) -> None:
        self.watched = np.zeros((DAYS, DAY_BINS))
        self.open = np.zeros((DAYS, DAY_BINS))
        self.errors = np.zeros(len(SETTINGS))

    def add(self, minutes: np.ndarray, state: np.ndarray, weights: Array) -> None:
        """Count looks at minutes of the week (n,), that saw `state` (n,), 0 or 1."""
        bins = minutes // BIN
        size = DAYS * DAY_BINS
        self.watched += np.bincount(bins, weights, size).reshape(DAYS, DAY_BINS)
        self.open += np.bincount(bins, weights * state, size).reshape(DAYS, DAY_BINS)

    def compare(
        self, estimates: Array, minutes: np.ndarray, state: np.ndarray, weights: Array
    ) -> None:
        """Add the errors of what the settings (3, 1008) forecast for the looks."""
        self.errors += (estimates[:, minutes // BIN] - state) ** 2 @ weights

    def estimates(self, scale: float) -> Array:
        """(3, 1008) rate of state 1 in each bin of the week, by each of the SETTINGS; the counts
        are multiplied by `scale`."""
        counts = scale * self.watched, scale * self.open
        return np.array([_rates(*counts, setting) for setting in SETTINGS])

    def blend(self, estimates: Array, scale: float) -> Array:
        """(1008,) weighted mean of the estimates."""
        losses = scale * (self.errors - self.errors.min()) / INDEPENDENT
        weights = PRIOR_WEIGHTS * np.exp(-LEARNING_RATE * losses)
        return weights / weights.sum() @ estimates

    def rates(self, scale: float) -> Array:
        """(1008,) the best estimate."""
        return self.blend(self.estimates(scale), scale)


def at_minutes(rates: Array, minutes: np.ndarray) -> Array:
    """The rate at minutes of the week (any shape)."""
    return rates[(minutes % WEEK_MINUTES) // BIN]


def _rates(watched: Array, opened: Array, setting: Setting) -> Array:
    prior, weight = _prior(watched, opened, setting).ravel(), setting.prior_weeks * BIN
    seen = _smooth(opened.ravel(), setting)
    rate = (seen + weight * prior) / (_smooth(watched.ravel(), setting) + weight)
    return np.clip(rate, MIN_RATE, 1.0 - MIN_RATE)


def _prior(watched: Array, opened: Array, setting: Setting) -> Array:
    """(7, 144): the rate of the time of day, times a factor of the weekday."""
    mean = (opened.sum() + 0.5 * PRIOR_WATCH) / (watched.sum() + PRIOR_WATCH)
    weight = PRIOR_DAYS * BIN
    seen = _smooth(opened.sum(0), setting) + weight * mean
    by_time = seen / (_smooth(watched.sum(0), setting) + weight)
    few = mean * PRIOR_WATCH
    factor = (opened.sum(axis=1) + few) / ((watched * by_time).sum(axis=1) + few)
    drawn = np.minimum(1.0 + setting.weekday_share * (factor - 1.0), MAX_FACTOR * factor)
    return np.minimum(drawn[:, None] * by_time, MAX_PRIOR)


def _smooth(values: Array, setting: Setting) -> Array:
    return gaussian_filter1d(values, setting.smoothing / BIN, mode="wrap")
