"""Habits: doors that open by the hour and the weekday, for times of any distribution."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from dynslam_env.calendar.door_calendar import (
    DAY,
    FIRST_MONDAY,
    MONDAY_2026,
    WEEK,
    DoorCalendar,
    clipped,
)
from slam.errors import InputError
from slam.forecast.watched import Runs
from slam.geometry import Array
from slam.io.door_runs import read_door_runs
from slam.io.files import AnyPath
from slam.validation import instance, number, positive, whole, within

HOUR = 3600.0  # s
MIN_RATE = 0.002  # least share of the time in a state: each door is used now and then
SETTLING = 2.0 * DAY  # s, simulated before a history, so that it begins in equilibrium
BLOCK = 64  # dwell times drawn at once

NIGHT, OFFICE_DAY = (0.03,) * 7, (0.3, 0.6, 0.6, 0.5, 0.35, 0.3, 0.5, 0.6, 0.5, 0.4, 0.2)
WORKDAY = (*NIGHT, *OFFICE_DAY, 0.1, 0.05, *NIGHT[:4])
WEEKEND = (0.03,) * 24
OFFICE_WEEK = (WORKDAY,) * 5 + (WEEKEND,) * 2
"""P(open) by weekday, Monday first, and hour, of an office door."""


@runtime_checkable
class Dwell(Protocol):
    """The distribution of dwell times, as multiples of their mean."""

    def draw(self, state: int, count: int, rng: np.random.Generator) -> Array:
        """(count,) dwell times in a state, 1 open, with mean 1."""
        ...


@dataclass(frozen=True)
class Weibull:
    """Dwell times of a Weibull distribution.

    shape  below 1 many are short and a few very long, as of real doors; 1 is exponential; above 1
           they are regular
    """

    shape: float = 0.6

    def __post_init__(self) -> None:
        within(self, "shape", 0.2, 20.0)

    def draw(self, state: int, count: int, rng: np.random.Generator) -> Array:
        """See `Dwell.draw`."""
        return rng.weibull(self.shape, count) / math.gamma(1.0 + 1.0 / self.shape)


@dataclass(frozen=True)
class Empirical:
    """Dwell times drawn from those that were observed, for each state.

    closed, opened  s, of which each is as probable as the others
    """

    closed: tuple[float, ...]
    opened: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("closed", "opened"):
            times = np.asarray(getattr(self, name), dtype=np.float64)
            if times.ndim != 1 or not len(times) or not (times > 0).all() or np.isinf(times).any():
                raise InputError(
                    f"Empirical.{name} must be dwell times > 0 s, got {times.tolist()}"
                )

    @staticmethod
    def of_file(file: AnyPath) -> Empirical:
        """The dwell times of a door's history, whose first and last run are left out, as are those
        at gaps: see `read_door_runs`."""
        runs = read_door_runs(file)
        joined = runs.begin[1:] == runs.end[:-1]
        new = np.concatenate([[True], ~joined | (runs.state[1:] != runs.state[:-1])])
        first, last = np.flatnonzero(new), np.append(np.flatnonzero(new)[1:], len(new)) - 1
        begins, ends, states = runs.begin[first], runs.end[last], runs.state[first]
        at_change = ends[:-1] == begins[1:]
        seen = np.concatenate([[False], at_change]) & np.concatenate([at_change, [False]])
        closed, opened = ((ends - begins)[seen & (states == state)] for state in (0, 1))
        return Empirical(tuple(closed.tolist()), tuple(opened.tolist()))

    def draw(self, state: int, count: int, rng: np.random.Generator) -> Array:
        """See `Dwell.draw`."""
        times = np.array(self.opened if state else self.closed)
        return rng.choice(times, count) / times.mean()


@dataclass(frozen=True)
class Habits(DoorCalendar):
    """Doors with habits: a semi-Markov process whose mean dwell times follow the week.

    A dwell time is drawn as a multiple of its mean. The means change from hour to hour; time passes
    for the door by the reciprocal of the mean. So the share of the time that a door is open is that
    of `week`, whatever the distribution.

    week     (7, 24) P(open) by weekday, Monday first, and hour (UTC)
    cycle    s, mean time from one opening to the next
    dwell    the distribution of the dwell times
    variety  standard deviation of what tells the doors apart: their log-odds of being open
    begin    s, unix time
    seed     of the doors: others do other things on the same date
    """

    week: tuple[tuple[float, ...], ...] = OFFICE_WEEK
    cycle: float = 1800.0
    dwell: Dwell = field(default=Weibull())
    variety: float = 1.0
    begin: float = MONDAY_2026
    seed: int = 0

    def __post_init__(self) -> None:
        positive(self, "cycle")
        within(self, "variety", 0.0, 10.0)
        whole(self, "seed", 0)
        number("Habits.begin", self.begin, 0.0)
        instance("Habits.dwell", self.dwell, Dwell)
        if np.shape(self.week) != (7, 24) or not ((rate := np.array(self.week)) >= 0).all():
            raise InputError("Habits.week must be 7 days of 24 probabilities each")
        if not (rate <= 1).all():
            raise InputError(f"Habits.week must be probabilities from 0 to 1, got {rate.max():g}")

    def rates(self, door: int) -> Array:
        """(168,) P(open) of a door in each hour of the week, from Monday 0:00."""
        rate = np.clip(np.ravel(self.week), MIN_RATE, 1.0 - MIN_RATE)
        shift = self.variety * np.random.default_rng([self.seed, door, 0]).standard_normal()
        odds = rate / (1.0 - rate) * math.exp(shift)
        return np.clip(odds / (1.0 + odds), MIN_RATE, 1.0 - MIN_RATE)

    def runs(self, door: int, begin: float, end: float) -> Runs:
        """See `DoorCalendar.runs`. Each week is drawn by itself, from the days before it on."""
        number("end", end, begin)
        weeks = range(*(int((t - FIRST_MONDAY) // WEEK) for t in (begin, end + WEEK)))
        parts = [self._of_week(door, week) for week in weeks]
        starts, states = (np.concatenate(part) for part in zip(*parts, strict=True))
        return clipped(starts, states, begin, end)

    def _of_week(self, door: int, week: int) -> tuple[Array, np.ndarray]:
        """Times from which on the door had the states, from Monday on."""
        monday = FIRST_MONDAY + week * WEEK
        rng = np.random.default_rng([self.seed, door, 1, week])
        rates = self.rates(door)
        days = round(SETTLING / HOUR)
        opened = np.concatenate([rates[-days:], rates])
        edges = np.arange(0.0, (len(opened) + 0.5) * HOUR, HOUR)
        passed = [
            np.concatenate([[0.0], np.cumsum(HOUR / (self.cycle * share))])
            for share in (1.0 - opened, opened)
        ]  # in units of the mean dwell time of the state, at the edges of the hours
        times = _alternating(edges, passed, self.dwell, int(rng.random() < opened[0]), rng)
        starts, states = times[0] + monday - SETTLING, times[1]
        first = max(int(np.searchsorted(starts, monday, side="right")) - 1, 0)
        return np.maximum(starts[first:], monday), states[first:]


def _alternating(
    edges: Array, passed: list[Array], dwell: Dwell, state: int, rng: np.random.Generator
) -> tuple[Array, np.ndarray]:
    """Times, s, from which on the process has the states (n,), until the last of the `edges`.

    passed  (2, hours + 1) by state: how many mean dwell times have passed at the edges
    """
    times, time = [0.0], 0.0
    states, drawn = [state], [np.empty(0), np.empty(0)]
    while time < edges[-1]:
        if not len(drawn[state]):
            drawn[state] = dwell.draw(state, BLOCK, rng)
        left, drawn[state] = drawn[state][-1], drawn[state][:-1]
        until = float(np.interp(time, edges, passed[state])) + left
        time = (
            float(np.interp(until, passed[state], edges)) if until < passed[state][-1] else math.inf
        )
        state = 1 - state
        times.append(max(time, times[-1] + 1e-3))
        states.append(state)
    return np.array(times[:-1]), np.array(states[:-1], dtype=np.int8)
