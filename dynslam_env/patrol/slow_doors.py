"""SlowDoors: doors with habits, of 60 to 400 s, some of which follow another door.

A small law for the patrol alone: replace it by another `Law` without any other change.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynslam_env.simulation.laws import MIN_DWELL, Bools, Clock
from slam.errors import InputError
from slam.validation import within

LONGEST_LAG = 20.0  # s, by which a door follows its leader


@dataclass(frozen=True)
class SlowDoors:
    """Each door has two habits, the mean times for which it stays open and closed.

    Both are drawn log-uniformly from `shortest` to `longest` once an episode; each stay is drawn
    from the habit times 1 -/+ `spread`, within `shortest` and `longest`. With the probability
    `coupled` a door has no habits of its own, but flips up to 20 s after its leader, the last door
    before it that has.

    shortest  s
    longest   s
    spread    0 to 1
    coupled   probability
    """

    shortest: float = 60.0
    longest: float = 400.0
    spread: float = 0.4
    coupled: float = 0.3

    def __post_init__(self) -> None:
        within(self, "shortest", MIN_DWELL)
        within(self, "longest", MIN_DWELL)
        within(self, "spread", 0.0, 1.0)
        within(self, "coupled", 0.0, 1.0)
        if self.shortest > self.longest:
            raise InputError(
                f"SlowDoors needs shortest <= longest, got {self.shortest:g} > {self.longest:g} s"
            )

    @property
    def lag(self) -> float:
        """s, by which a door follows its leader at most: no longer than the leader's stay."""
        return min(LONGEST_LAG, self.shortest / 2)

    def initial_states(self, is_open: Bools, rng: np.random.Generator) -> Bools:
        """The independent draws."""
        return is_open

    def clock(self, count: int, rng: np.random.Generator) -> Clock:
        """A clock whose doors are somewhere in their first stay at time 0."""
        return HabitClock(self, count, rng)


class HabitClock:
    """The `Clock` of `SlowDoors`.

    next_flip  s, of any door; inf without doors
    """

    def __init__(self, law: SlowDoors, count: int, rng: np.random.Generator):
        self._law, self._rng = law, rng
        low, high = math.log(law.shortest), math.log(law.longest)
        self._means = np.exp(rng.uniform(low, high, (count, 2)))  # s, of stays one after the other
        self._leads = rng.random(count) >= law.coupled  # whether it has habits of its own
        self._leads[:1] = True
        self._stays = np.zeros(count, dtype=np.int64)  # stays begun so far
        first = [self._stay(door) * rng.random() for door in range(count)]
        self._next = np.where(self._leads, first, math.inf)

    @property
    def next_flip(self) -> float:
        """See `Clock`."""
        return float(self._next.min(initial=math.inf))

    def flips_until(self, time: float) -> Sequence[int]:
        """See `Clock.flips_until`."""
        if not time < math.inf:
            raise InputError(f"time must be a finite number, got {time!r}")
        doors = []
        while self.next_flip <= time:
            door = int(self._next.argmin())
            doors.append(door)
            self._flip(door, float(self._next[door]))
        return doors

    def _flip(self, door: int, time: float) -> None:
        if not self._leads[door]:
            self._next[door] = math.inf  # until its leader flips
            return
        self._next[door] = time + self._stay(door)
        for follower in range(door + 1, len(self._next)):
            if self._leads[follower]:
                return
            self._next[follower] = time + self._rng.uniform(0.0, self._law.lag)

    def _stay(self, door: int) -> float:
        law, mean = self._law, self._means[door, self._stays[door] % 2]
        self._stays[door] += 1
        drawn = mean * self._rng.uniform(1.0 - law.spread, 1.0 + law.spread)
        return float(min(max(drawn, law.shortest), law.longest))
