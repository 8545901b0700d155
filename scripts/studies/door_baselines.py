"""Plain forecasts of a door, to compare with; each learns from a history and returns a function.

Mean rate, hour of day, hour of week; FreMEn (Krajnik et al. 2017): the mean and the strongest
harmonics of the week; two-state Markov chain of one minute; persistence.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slam.geometry import Array

from .door_minutes import DAY, WEEK, Looks, Minutes, looks

ORDER = 16  # harmonics of FreMEn
HARMONICS = np.arange(1, 169)  # cycles a week: periods from a week to an hour
HOUR = 60  # min
MIN_WATCH = 1.0  # min, at the mean rate, in each bin

Forecast = Callable[[Minutes, Looks, int], Array]
"""P(state = 1) at the minutes `now` of the looks, made `horizon` min earlier."""


def mean_rate(history: Minutes) -> Forecast:
    """The share of the time in state 1."""
    rate = float(history.state.mean())
    return lambda minutes, pairs, horizon: np.full(len(pairs.now), rate)


def hour_of_day(history: Minutes) -> Forecast:
    """The rate of the hour of the day."""
    return _binned(history, DAY)


def hour_of_week(history: Minutes) -> Forecast:
    """The rate of the hour of the week."""
    return _binned(history, WEEK)


def fremen(history: Minutes) -> Forecast:
    """The mean rate and the ORDER strongest harmonics of the week, clipped to [0, 1]."""
    mean = float(history.state.mean())
    of_week = np.bincount(history.of_week, history.state - mean, WEEK)
    spectrum = np.fft.fft(of_week)[HARMONICS] / len(history.state)
    strongest = np.argsort(-abs(spectrum))[:ORDER]
    phase = 2j * np.pi * np.arange(WEEK)[:, None] * HARMONICS[strongest] / WEEK
    rates = np.clip(mean + 2.0 * (np.exp(phase) @ spectrum[strongest]).real, 0.0, 1.0)
    return lambda minutes, pairs, horizon: rates[minutes.of_week[pairs.now]]


def markov_chain(history: Minutes) -> Forecast:
    """The chain whose steps of a minute are as frequent as in the history."""
    pairs = looks(history, 1)
    before, after = history.state[pairs.look], history.state[pairs.now]
    rise, fall = float(after[before == 0].mean()), float(1.0 - after[before == 1].mean())
    rate = rise / (rise + fall)

    def forecast(minutes: Minutes, pairs: Looks, horizon: int) -> Array:
        return rate + (minutes.state[pairs.look] - rate) * (1.0 - rise - fall) ** horizon

    return forecast


def persistence(history: Minutes) -> Forecast:
    """What was seen last."""
    return lambda minutes, pairs, horizon: minutes.state[pairs.look].astype(np.float64)


def _binned(history: Minutes, period: int) -> Forecast:
    bins = history.of_week % period // HOUR
    watched = np.bincount(bins, minlength=period // HOUR)
    opened = np.bincount(bins, history.state, period // HOUR)
    rates = (opened + MIN_WATCH * history.state.mean()) / (watched + MIN_WATCH)
    return lambda minutes, pairs, horizon: rates[minutes.of_week[pairs.now] % period // HOUR]


UNSEEING = {
    "mean rate": mean_rate,
    "hour of day": hour_of_day,
    "hour of week": hour_of_week,
    "FreMEn, order 16": fremen,
}
"""Those that know no look."""
SEEING = {"Markov chain": markov_chain, "persistence": persistence}
"""Those that know only the look: without one there is no forecast."""
