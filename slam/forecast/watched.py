"""Runs of equal state as minutes that were watched, and the minutes watched last."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from slam.errors import InputError
from slam.forecast.clock import DAY_MINUTES, EARLIEST, LATEST, MINUTE
from slam.forecast.relaxation import LAG_END
from slam.geometry import Array

UNKNOWN = -1  # state of a minute that was not watched; age of a state whose begin was not seen
MAX_RUN = 10 * 365.25 * 86400.0  # s; a longer run is a mistake in the times
LOOK_WORTH = 30  # min: a look counts for the time since the one before, but for no more than this


class Runs(NamedTuple):
    """Checked runs (n,): begin and end in s (unix time), state 0 or 1."""

    begin: Array
    end: Array
    state: np.ndarray


class Block(NamedTuple):
    """Watched minutes of one day, and the minutes before; m = LAG_END + length.

    first   minute since 1970 of the first entry
    state   (m,) int8, UNKNOWN where nothing was watched
    age     (m,) int64 min since the state began, UNKNOWN if that was not seen
    new     (n,) indices of the minutes that are new
    weight  (n,) minutes for which the new ones count, in the weekly rates
    """

    first: int
    state: np.ndarray
    age: np.ndarray
    new: np.ndarray
    weight: Array


class Window:
    """The last LAG_END minutes, in constant memory."""

    def __init__(self) -> None:
        self.last: int | None = None  # minute since 1970
        self.state = np.full(LAG_END, UNKNOWN, np.int8)
        self.age = np.full(LAG_END, UNKNOWN, np.int64)

    def append(self, minutes: np.ndarray, state: np.ndarray) -> Block:
        """The block of new `minutes` (n,), increasing and later than all before, with `state`; from
        then on they belong to the window."""
        before = int(minutes[0]) - LOOK_WORTH if self.last is None else self.last
        first = int(minutes[0]) - LAG_END
        length = int(minutes[-1]) - first + 1
        states, ages = np.full(length, UNKNOWN, np.int8), np.full(length, UNKNOWN, np.int64)
        shift = int(minutes[0]) - 1 - before  # minutes without a look before the new ones
        if self.last is not None and shift < LAG_END:
            states[: LAG_END - shift], ages[: LAG_END - shift] = (
                self.state[shift:],
                self.age[shift:],
            )
        new = minutes - first
        states[new] = state
        _fill_ages(states, ages, int(new[0]))
        self.last, self.state, self.age = int(minutes[-1]), states[-LAG_END:], ages[-LAG_END:]
        weight = np.minimum(np.diff(minutes, prepend=before), LOOK_WORTH).astype(np.float64)
        return Block(first, states, ages, new, weight)


def checked(begin_s: Any, end_s: Any, state: Any, after: float) -> Runs:
    """Runs (n,) in order of time that begin at `after` or later. Raises InputError for others."""
    begin, end, states = (
        np.atleast_1d(values)
        for values in (
            check_times("begin_s", begin_s), check_times("end_s", end_s),
            check_states("state", state),
        )
    )  # fmt: skip
    if not begin.shape == end.shape == states.shape or begin.ndim != 1:
        raise InputError(
            f"begin_s, end_s and state must be of one length, got shapes {begin.shape}, "
            f"{end.shape} and {states.shape}"
        )
    empty = np.flatnonzero(end <= begin)
    if len(empty):
        k = int(empty[0])
        raise InputError(f"run {k} ends at {end[k]:.0f} s, not after its begin {begin[k]:.0f} s")
    long = np.flatnonzero(end - begin > MAX_RUN)
    if len(long):
        raise InputError(f"run {int(long[0])} lasts over ten years: are its times in s?")
    back = np.flatnonzero(begin < np.concatenate([[after], end[:-1]]))
    if len(back):
        k = int(back[0])
        known = after if k == 0 else end[k - 1]
        raise InputError(
            f"run {k} begins at {begin[k]:.0f} s, before {known:.0f} s, up to which the door is "
            f"known already: was the clock set back?"
        )
    return Runs(begin, end, states)


def check_times(name: str, times: Any) -> Array:
    """Unix times in s as float64. Raises InputError for NaN and what is no unix time."""
    try:
        values = np.asarray(times)
    except ValueError:
        raise InputError(f"{name} must be numbers of one length each, got {times!r}") from None
    if values.dtype.kind not in "iuf":
        raise InputError(f"{name} must be unix times in s, got {values.dtype}")
    values = values.astype(np.float64)
    if not ((values >= EARLIEST) & (values <= LATEST)).all():  # NaN too
        bad = values[~((values >= EARLIEST) & (values <= LATEST))].flat[0]
        raise InputError(f"{name} must be finite unix times in s, got {bad:g}")
    return values


def check_states(name: str, state: Any) -> np.ndarray:
    """States as int8. Raises InputError for values other than 0 and 1."""
    try:
        values = np.asarray(state)
    except ValueError:
        raise InputError(f"{name} must be 0 or 1, got {state!r}") from None
    if values.dtype.kind not in "biuf" or not np.isin(values, (0, 1)).all():
        raise InputError(f"{name} must be 0 or 1, got {_first_other(values)!r}")
    return values.astype(np.int8)


def days(runs: Runs, last: int | None) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The minutes since 1970 that the runs touch, later than `last`, day by day, and their state.

    A minute counts once, with the state of the first run that touches it.
    """
    first, stop = runs.begin // MINUTE, np.ceil(runs.end / MINUTE)
    first = np.maximum(first, np.concatenate([[-np.inf if last is None else last + 1], stop[:-1]]))
    keep = stop > first
    pieces: list[tuple[np.ndarray, np.ndarray]] = []
    today = None
    for low, high, state in zip(
        first[keep].astype(int).tolist(), stop[keep].astype(int).tolist(),
        runs.state[keep].tolist(), strict=True,
    ):  # fmt: skip
        while low < high:
            day = low // DAY_MINUTES
            if day != today and pieces:
                yield _joined(pieces)
                pieces = []
            until = min(high, (day + 1) * DAY_MINUTES)
            pieces.append((np.arange(low, until), np.full(until - low, state, np.int8)))
            low, today = until, day
    if pieces:
        yield _joined(pieces)


def _joined(pieces: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    minutes, states = zip(*pieces, strict=True)
    return np.concatenate(minutes), np.concatenate(states)


def _fill_ages(states: np.ndarray, ages: np.ndarray, begin: int) -> None:
    """Fill in the ages from index `begin` > 0 on: 0 after a change that was seen, unknown after a
    gap, else a minute more than a minute before."""
    here, before = states[begin:], states[begin - 1 : -1]
    gap = (here == UNKNOWN) | (before == UNKNOWN)
    event = np.flatnonzero(gap | (here != before))
    index = np.arange(len(here))
    place = np.searchsorted(event, index, side="right") - 1
    inherited = ages[begin - 1] + 1 + index if ages[begin - 1] >= 0 else np.full_like(index, -1)
    if len(event):
        since = event[np.maximum(place, 0)]
        counted = np.where(gap[since], UNKNOWN, index - since)
        inherited = np.where(place >= 0, counted, inherited)
    ages[begin:] = inherited


def _first_other(values: np.ndarray) -> Any:
    other = [value for value in values.ravel().tolist() if value not in (0, 1)]
    return other[0] if other else values.dtype.name
