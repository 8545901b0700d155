"""Doors that obey a calendar: what each of them did, and will do, at any date.

A calendar gives the history of every door as runs of equal state, in unix time. It is also a law
(`dynslam_env.Law`): an episode begins at the calendar's date, and its doors move as in the history.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from math import inf

import numpy as np

from dynslam_env.simulation.laws import Bools, Clock, FlipClock
from slam.errors import InputError
from slam.forecast.clock import DAY_MINUTES, MINUTE, MONDAY, WEEK_MINUTES
from slam.forecast.watched import Runs
from slam.io.door_runs import read_door_runs
from slam.io.files import AnyPath
from slam.validation import instance, number

DAY, WEEK = float(MINUTE * DAY_MINUTES), float(MINUTE * WEEK_MINUTES)  # s
FIRST_MONDAY = WEEK - float(MINUTE * MONDAY)  # s, unix time: 5 January 1970, 0:00 UTC
MONDAY_2026 = 1767571200.0  # s, unix time: Monday, 5 January 2026, 0:00 UTC
EPISODE = DAY  # s, for which the doors of an episode are known


class DoorCalendar(ABC):
    """The histories of doors, and the law by which they move from the date `begin` on.

    begin  s, unix time: date of the beginning of an episode; local time is UTC
    """

    begin: float

    @abstractmethod
    def runs(self, door: int, begin: float, end: float) -> Runs:
        """The history of a door from `begin` to `end`, s, unix time: runs of equal state without
        gaps, state 1 open. The same door and date always give the same state."""

    def initial_states(self, is_open: Bools, rng: np.random.Generator) -> Bools:
        """The states at the date `begin`; the draws `is_open` and `rng` are unused."""
        first = [self.runs(door, self.begin, self.begin + 1.0) for door in range(len(is_open))]
        return np.array([runs.state[0] == 1 for runs in first], dtype=np.bool_)

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """The flips of the day from `begin` on; `rng` is unused."""
        return FlipClock(
            [
                (float(time) - self.begin, door)
                for door in range(count)
                for time in self.runs(door, self.begin, self.begin + EPISODE).begin[1:]
            ],
            lambda: inf,
        )


@dataclass(frozen=True)
class Recorded(DoorCalendar):
    """Doors that do what a real door did, week after week of its recorded history.

    Door k is k weeks ahead of door 0. Where the history has a gap, the state before it lasts. After
    its last whole week it begins again.

    file   a CSV file with the header `begin_s,end_s,state`, state 1 open: see `read_door_runs`
    begin  s, unix time
    """

    file: AnyPath
    begin: float = MONDAY_2026
    history: Runs = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        number("Recorded.begin", self.begin)
        object.__setattr__(self, "history", _whole_weeks(read_door_runs(self.file), self.file))

    def runs(self, door: int, begin: float, end: float) -> Runs:
        """See `DoorCalendar.runs`."""
        history = self.history
        first, length = history.begin[0], history.end[-1] - history.begin[0]
        ahead = (begin - first + door * WEEK) % length  # of the history's first Monday
        turns = np.arange(int((ahead + end - begin) // length) + 1) * length
        starts = (history.begin - first + turns[:, None]).ravel() - ahead + begin
        return clipped(starts, np.tile(history.state, len(turns)), begin, end)


@dataclass(frozen=True)
class InPairs(DoorCalendar):
    """Doors 2 k and 2 k + 1 open and close together, as door k of another calendar.

    calendar  of the pairs; its `begin` is that of this one
    opposed   True: of a pair, one is open and the other closed
    """

    calendar: DoorCalendar
    opposed: bool = False

    def __post_init__(self) -> None:
        instance("InPairs.calendar", self.calendar, DoorCalendar)
        instance("InPairs.opposed", self.opposed, bool)

    @property
    def begin(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride]
        """See `DoorCalendar`."""
        return self.calendar.begin

    def runs(self, door: int, begin: float, end: float) -> Runs:
        """See `DoorCalendar.runs`."""
        found = self.calendar.runs(door // 2, begin, end)
        other = self.opposed and door % 2 == 1
        return found._replace(state=(1 - found.state).astype(np.int8)) if other else found


def clipped(starts: np.ndarray, states: np.ndarray, begin: float, end: float) -> Runs:
    """Runs from `begin` to `end`, given the times (n,), s, increasing, from which on a door had the
    `states` (n,); equal neighbours are one run. The first start is not after `begin`."""
    low = int(np.searchsorted(starts, begin, side="right")) - 1
    high = int(np.searchsorted(starts, end, side="left"))
    starts, states = np.maximum(starts[low:high], begin), states[low:high]
    changed = np.concatenate([[True], states[1:] != states[:-1]])
    starts, states = starts[changed], states[changed]
    return Runs(starts, np.append(starts[1:], end), states.astype(np.int8))


def _whole_weeks(history: Runs, file: AnyPath) -> Runs:
    """The runs between the first and the last Monday of a history, without gaps."""
    first = FIRST_MONDAY + np.ceil((history.begin[0] - FIRST_MONDAY) / WEEK) * WEEK
    last = FIRST_MONDAY + np.floor((history.end[-1] - FIRST_MONDAY) / WEEK) * WEEK
    if last <= first:
        raise InputError(f"{file}: a door's history must hold a whole week, Monday to Sunday")
    return clipped(history.begin, history.state, float(first), float(last))
