"""A door's history at each full minute, for scores of its forecasts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.forecast.watched import Runs
from slam.geometry import Array

MINUTE, DAY = 60, 1440  # s; min
WEEK = 7 * DAY
MONDAY = 3 * DAY  # min from Monday 0:00 to the time 0, on a Thursday


class Minutes(NamedTuple):
    """The watched minutes of a door; arrays (n,).

    minute  min since 1970, increasing
    state   0 or 1 at that time
    since   s, unix time when that state began; NaN: its begin was not seen
    """

    minute: np.ndarray
    state: np.ndarray
    since: Array

    @property
    def of_week(self) -> np.ndarray:
        """(n,) minutes since Monday 0:00 UTC."""
        return (self.minute + MONDAY) % WEEK


class Looks(NamedTuple):
    """Pairs of a minute and a look some time before, as indices (n,) into `Minutes`."""

    now: np.ndarray
    look: np.ndarray


def minutes_of(runs: Runs) -> Minutes:
    """The full minutes within the runs."""
    first = np.ceil(runs.begin / MINUTE).astype(np.int64)
    stop = np.ceil(runs.end / MINUTE).astype(np.int64)
    run = np.repeat(np.arange(len(first)), stop - first)
    within = np.arange(len(run)) - np.repeat(np.cumsum(stop - first) - (stop - first), stop - first)
    seen = np.concatenate([[False], runs.begin[1:] == runs.end[:-1]])
    since = np.where(seen, runs.begin, np.nan)
    return Minutes(first[run] + within, runs.state[run].astype(np.int64), since[run])


def looks(minutes: Minutes, horizon: int) -> Looks:
    """The minutes for which the door was watched `horizon` min before, too."""
    at = np.searchsorted(minutes.minute, minutes.minute - horizon)
    found = minutes.minute[at] == minutes.minute - horizon
    return Looks(np.flatnonzero(found), at[found])


def between(runs: Runs, begin: float, end: float) -> Runs:
    """The part of the runs in [begin, end), s."""
    low, high = np.maximum(runs.begin, begin), np.minimum(runs.end, end)
    some = high > low
    return Runs(low[some], high[some], runs.state[some])
