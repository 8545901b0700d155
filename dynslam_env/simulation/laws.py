"""Door laws: at what times doors flip. Each is a small object; the doors and their physics are not.

| law           | time from one flip of a door to its next                                   |
|---------------|----------------------------------------------------------------------------|
| `Uniform`     | U(shortest, longest): the paper's doors, 5 to 20 s                          |
| `Exponential` | Exp(mean), memoryless: a Poisson process, the two-state Markov chain's own  |
| `Periodic`    | always the same, from a random phase: what can be learnt perfectly          |
| `Scripted`    | as written down, to the bit: for tests, and for one story told many times   |
| `Fixed`      | there is none: leaves are fixed                                             |
| `Coupled`     | another law's, but doors flip in pairs: cells that are not independent      |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from heapq import heapreplace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from slam.errors import InputError
from slam.validation import instance, number, whole_number, within

Bools = NDArray[np.bool_]

MIN_DWELL = 1e-3  # s: shorter times would let flips pile up until none moves time forward


class Clock(Protocol):
    """Which doors are to change, and when."""

    @property
    def soonest(self) -> float:
        """s, time of the next flip; inf for none. Before it there is no need to ask `due`."""
        ...

    def due(self, time: float) -> Sequence[int]:
        """The doors that flip between the last call and `time`, s, in the order of their times.

        A door that flips twice is named twice; at equal times the lower number comes first.
        """
        ...


@runtime_checkable
class Law(Protocol):
    """How doors flip. One law can serve any number of episodes: it keeps no state."""

    def begin(self, is_open: Bools, rng: np.random.Generator) -> Bools:
        """The doors' first states (d,), made out of independent draws `is_open` (d,)."""
        ...

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """A new clock of `count` doors at time 0; the same state of `rng`, the same flips."""
        ...


def _as_drawn(self: Law, is_open: Bools, rng: np.random.Generator) -> Bools:
    """Doors begin independent of each other: as they were drawn."""
    return is_open


@dataclass(frozen=True)
class Uniform:
    """Each door flips after a time of its own, drawn anew from U(shortest, longest) each time.

    The first flip comes such a time after the beginning.

    shortest  s, from one flip to the next
    longest   s
    """

    shortest: float = 5.0
    longest: float = 20.0

    def __post_init__(self) -> None:
        within(self, "shortest", MIN_DWELL)
        within(self, "longest", MIN_DWELL)
        if self.shortest > self.longest:
            raise InputError(
                f"Uniform needs shortest <= longest, got {self.shortest:g} > {self.longest:g} s"
            )

    begin = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """Every door its own sequence of uniform times."""
        first = rng.uniform(self.shortest, self.longest, count)
        return FlipClock(_first_flips(first), lambda: rng.uniform(self.shortest, self.longest))


@dataclass(frozen=True)
class Exponential:
    """Each door flips as a Poisson process: when it last flipped says nothing about the next time.

    mean  s, from one flip of a door to its next
    """

    mean: float = 12.5

    def __post_init__(self) -> None:
        within(self, "mean", MIN_DWELL)

    begin = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """Every door its own sequence of exponential times."""
        first = rng.exponential(self.mean, count)
        return FlipClock(_first_flips(first), lambda: rng.exponential(self.mean))


@dataclass(frozen=True)
class Periodic:
    """Each door flips every `period` s; a random phase of each door is drawn at the beginning.

    period  s, from one flip of a door to its next: it is open for so long, then closed for so long
    """

    period: float = 12.5

    def __post_init__(self) -> None:
        within(self, "period", MIN_DWELL)

    begin = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """Every door its own phase, from U(0, period)."""
        return FlipClock(_first_flips(rng.uniform(0.0, self.period, count)), lambda: self.period)


@dataclass(frozen=True)
class Scripted:
    """Doors flip exactly when the script says; nothing is random.

    flips  (time in s, number of the door) in any order; lists will do, and are kept as tuples
    """

    flips: tuple[tuple[float, int], ...] = ()

    def __post_init__(self) -> None:
        for flip in _listed(self.flips):
            if len(_listed(flip)) != 2:
                raise InputError(f"Scripted.flips must hold pairs (time, door), got {flip!r}")
            number("a time of Scripted.flips", flip[0], 0.0)
            whole_number("a door of Scripted.flips", flip[1], 0)
        object.__setattr__(self, "flips", tuple((time, door) for time, door in self.flips))

    begin = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """The script from its beginning; `rng` is not used. Errors: it names a door beyond them."""
        for time, door in self.flips:
            if door >= count:
                raise InputError(
                    f"Scripted.flips must name doors from 0 on, below their count of {count}, "
                    f"got door {door} at {time:g} s"
                )
        return FlipClock(self.flips, lambda: math.inf)


@dataclass(frozen=True)
class Fixed:
    """No door ever flips, and leaves are fixed: they do not give way either.

    `Scripted()` without flips has doors that nobody moves, but that can be pushed.
    """

    begin = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """A clock that never strikes; `rng` is not used."""
        return FlipClock((), lambda: math.inf)


@dataclass(frozen=True)
class Coupled:
    """Doors 2 k and 2 k + 1 flip together; an odd last one flips alone.

    law      at what times; to it, each pair is one door (pair k is door k of a script)
    opposed  False: both of a pair are open, or both closed; True: one of each
    """

    law: Law = field(default=Uniform())
    opposed: bool = False

    def __post_init__(self) -> None:
        instance("Coupled.law", self.law, Law)
        instance("Coupled.opposed", self.opposed, bool)

    def begin(self, is_open: Bools, rng: np.random.Generator) -> Bools:
        """The first of each pair as drawn, the second like it, or contrary to it."""
        both = np.repeat(self.law.begin(is_open[::2], rng), 2)[: len(is_open)]
        both[1::2] ^= self.opposed
        return both

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """The law's clock of half as many doors."""
        return _PairClock(self.law.clock((count + 1) // 2, rng), count)


class FlipClock:
    """A `Clock` that holds the next flip of every door in a heap.

    flips  (time in s, door) that are known at the beginning, in any order
    dwell  draws the time, s, from a flip of a door to its next; inf for none
    """

    def __init__(self, flips: Iterable[tuple[float, int]], dwell: Callable[[], float]):
        self._next = sorted((time, door) for time, door in flips)  # sorted, it is a heap
        self._dwell = dwell
        self.soonest = self._next[0][0] if self._next else math.inf

    def due(self, time: float) -> list[int]:
        """See `Clock.due`."""
        if not time < math.inf:
            raise InputError(f"time must be a finite number, got {time!r}")
        doors = []
        while self.soonest <= time:
            door = self._next[0][1]
            heapreplace(self._next, (self.soonest + self._dwell(), door))
            self.soonest = self._next[0][0]
            doors.append(door)
        return doors


class _PairClock:
    """A clock of pairs of doors as a clock of doors."""

    def __init__(self, pairs: Clock, count: int):
        self._pairs, self._count = pairs, count
        self.soonest = pairs.soonest

    def due(self, time: float) -> list[int]:
        """See `Clock.due`."""
        pairs = self._pairs.due(time)
        self.soonest = self._pairs.soonest
        return [door for k in pairs for door in (2 * k, 2 * k + 1) if door < self._count]


def _listed(values: Sequence[Any]) -> Sequence[Any]:
    if not isinstance(values, tuple | list):
        raise InputError(f"Scripted.flips must hold pairs (time, door), got {values!r}")
    return values


def _first_flips(times: NDArray[np.float64]) -> Iterable[tuple[float, int]]:
    """(time, door) of the doors' first flips."""
    return ((time, door) for door, time in enumerate(times.tolist()))
