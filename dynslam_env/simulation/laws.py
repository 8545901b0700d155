"""Door laws: the times at which doors flip (open or close).

| law           | time from one flip of a door to its next                                  |
|---------------|---------------------------------------------------------------------------|
| `Uniform`     | U(shortest, longest): the paper's doors, 5 to 20 s                         |
| `Exponential` | Exp(mean), memoryless: a Poisson process, a two-state Markov chain         |
| `Periodic`    | constant, with a random phase: can be predicted perfectly                  |
| `Scripted`    | given in advance: reproducible to the bit                                  |
| `Fixed`       | infinite: the leaves are immovable                                         |
| `Coupled`     | another law's, but doors flip in pairs: their cells are not independent    |
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
    """The sequence of flips of an episode's doors."""

    @property
    def next_flip(self) -> float:
        """Time of the next flip, s; inf for none. Before it `flips_until` returns nothing."""
        ...

    def flips_until(self, time: float) -> Sequence[int]:
        """Indices of the doors that flip after the last call and up to `time`, s, in order of time.

        A door that flips twice occurs twice; at equal times the lower index comes first.
        """
        ...


@runtime_checkable
class Law(Protocol):
    """A rule by which doors flip. It has no state: one law serves any number of episodes.

    ```python
    class EverySecond:
        def initial_states(self, is_open, rng):
            return is_open

        def clock(self, count, rng):
            return dynslam_env.FlipClock([(1.0, door) for door in range(count)], lambda: 1.0)

    dynslam_env.register_law("every-second", EverySecond())
    env = gym.make("DoorCorridor-v0", doors="every-second")
    ```
    """

    def initial_states(self, is_open: Bools, rng: np.random.Generator) -> Bools:
        """Initial states (d,) of the doors, given independent draws `is_open` (d,)."""
        ...

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """A new clock for `count` doors at time 0; the same state of `rng` gives the same flips."""
        ...


def _as_drawn(self: Law, is_open: Bools, rng: np.random.Generator) -> Bools:
    """Initial states are the independent draws."""
    return is_open


@dataclass(frozen=True)
class Uniform:
    """The time between two flips of a door is drawn from U(shortest, longest), for each door anew.

    The time to the first flip has the same distribution.

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

    initial_states = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """Independent uniform times for each door."""
        first = rng.uniform(self.shortest, self.longest, count)
        return FlipClock(_first_flips(first), lambda: rng.uniform(self.shortest, self.longest))


@dataclass(frozen=True)
class Exponential:
    """The flips of each door are a Poisson process: the time to the next flip is memoryless.

    mean  s, from one flip of a door to its next
    """

    mean: float = 12.5

    def __post_init__(self) -> None:
        within(self, "mean", MIN_DWELL)

    initial_states = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """Independent exponential times for each door."""
        first = rng.exponential(self.mean, count)
        return FlipClock(_first_flips(first), lambda: rng.exponential(self.mean))


@dataclass(frozen=True)
class Periodic:
    """Each door flips every `period` s, with a random phase of its own.

    period  s, from one flip of a door to its next: the time open and the time closed
    """

    period: float = 12.5

    def __post_init__(self) -> None:
        within(self, "period", MIN_DWELL)

    initial_states = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """A phase from U(0, period) for each door."""
        return FlipClock(_first_flips(rng.uniform(0.0, self.period, count)), lambda: self.period)


@dataclass(frozen=True)
class Scripted:
    """Doors flip at given times; nothing is random.

    flips  pairs (time in s, index of the door) in any order; lists are converted to tuples
    """

    flips: tuple[tuple[float, int], ...] = ()

    def __post_init__(self) -> None:
        for flip in _listed(self.flips):
            if len(_listed(flip)) != 2:
                raise InputError(f"Scripted.flips must hold pairs (time, door), got {flip!r}")
            number("a time of Scripted.flips", flip[0], 0.0)
            whole_number("a door of Scripted.flips", flip[1], 0)
        object.__setattr__(self, "flips", tuple((time, door) for time, door in self.flips))

    initial_states = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """The given flips; `rng` is unused. Raises InputError for the index of a missing door."""
        for time, door in self.flips:
            if door >= count:
                raise InputError(
                    f"Scripted.flips must name doors from 0 on, below their count of {count}, "
                    f"got door {door} at {time:g} s"
                )
        return FlipClock(self.flips, lambda: math.inf)


@dataclass(frozen=True)
class Fixed:
    """No door ever flips, and the leaves are immovable.

    `Scripted()` without flips has doors that do not move by themselves, but can be pushed.
    """

    initial_states = _as_drawn

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """A clock without flips; `rng` is unused."""
        return FlipClock((), lambda: math.inf)


@dataclass(frozen=True)
class Coupled:
    """Doors 2 k and 2 k + 1 flip together; the last of an odd number flips alone.

    law      the times; each pair counts as one door of it (pair k is door k of a script)
    opposed  False: the doors of a pair are both open or both closed; True: one is open
    """

    law: Law = field(default=Uniform())
    opposed: bool = False

    def __post_init__(self) -> None:
        instance("Coupled.law", self.law, Law)
        instance("Coupled.opposed", self.opposed, bool)

    def initial_states(self, is_open: Bools, rng: np.random.Generator) -> Bools:
        """The first door of each pair as drawn, the second equal or opposed to it."""
        both = np.repeat(self.law.initial_states(is_open[::2], rng), 2)[: len(is_open)]
        both[1::2] ^= self.opposed
        return both

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """The clock of the law for half as many doors."""
        return _PairClock(self.law.clock((count + 1) // 2, rng), count)


class FlipClock:
    """A `Clock` that holds the next flip of every door in a heap.

    flips  (time in s, door) known at the start, in any order
    dwell  draws the time, s, from a flip of a door to its next; inf for none
    """

    def __init__(self, flips: Iterable[tuple[float, int]], dwell: Callable[[], float]):
        self._next = sorted((time, door) for time, door in flips)  # sorted, it is a heap
        self._dwell = dwell
        self.next_flip = self._next[0][0] if self._next else math.inf

    def flips_until(self, time: float) -> list[int]:
        """See `Clock.flips_until`."""
        if not time < math.inf:
            raise InputError(f"time must be a finite number, got {time!r}")
        doors = []
        while self.next_flip <= time:
            door = self._next[0][1]
            heapreplace(self._next, (self.next_flip + self._dwell(), door))
            self.next_flip = self._next[0][0]
            doors.append(door)
        return doors


class _PairClock:
    """A clock of pairs of doors as a clock of doors."""

    def __init__(self, pairs: Clock, count: int):
        self._pairs, self._count = pairs, count
        self.next_flip = pairs.next_flip

    def flips_until(self, time: float) -> list[int]:
        """See `Clock.flips_until`."""
        pairs = self._pairs.flips_until(time)
        self.next_flip = self._pairs.next_flip
        return [door for k in pairs for door in (2 * k, 2 * k + 1) if door < self._count]


def _listed(values: Sequence[Any]) -> Sequence[Any]:
    if not isinstance(values, tuple | list):
        raise InputError(f"Scripted.flips must hold pairs (time, door), got {values!r}")
    return values


def _first_flips(times: NDArray[np.float64]) -> Iterable[tuple[float, int]]:
    """(time, door) of each door's first flip."""
    return ((time, door) for door, time in enumerate(times.tolist()))
