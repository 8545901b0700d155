"""Doors of our own making, whose laws are known."""

from __future__ import annotations

import numpy as np

from slam.forecast.watched import Runs

MONDAY = 1451865600.0  # s, 2016-01-04 0:00 UTC
MINUTE, HOUR, DAY, WEEK = 60.0, 3600.0, 86400.0, 604800.0


def runs_of(states: np.ndarray, begin: float = MONDAY) -> Runs:
    """Runs of a state a minute; -1: not watched."""
    first = np.flatnonzero(np.diff(states, prepend=-2))
    stop = np.append(first[1:], len(states))
    seen = states[first] >= 0
    return Runs(
        begin + MINUTE * first[seen].astype(np.float64),
        begin + MINUTE * stop[seen].astype(np.float64),
        states[first[seen]].astype(np.int8),
    )  # fmt: skip


def office(weeks: int) -> np.ndarray:
    """State 1 from nine to five on weekdays, minute by minute."""
    minute = np.arange(weeks * 7 * 1440)
    hour, day = minute // 60 % 24, minute // 1440 % 7
    return ((hour >= 9) & (hour < 17) & (day < 5)).astype(np.int8)


def chain(minutes: int, rise: float, fall: float, seed: int) -> np.ndarray:
    """A Markov chain with these probabilities of a change in a minute."""
    rng, state, out = np.random.default_rng(seed), 0, np.zeros(minutes, np.int8)
    for k, chance in enumerate(rng.random(minutes).tolist()):
        state ^= chance < (fall if state else rise)
        out[k] = state
    return out


def short_or_long(visits: int, seed: int) -> np.ndarray:
    """State 1 for one minute or for two hours, equally often; between for 1 to 60 min."""
    rng = np.random.default_rng(seed)
    pieces = [np.repeat([0, 1], [rng.integers(1, 61), rng.choice([1, 120])]) for _ in range(visits)]
    return np.concatenate(pieces).astype(np.int8)
