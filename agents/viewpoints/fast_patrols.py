"""FastPatrols: many patrols at once on viewpoint tables; true poses, no scans, no driving.

The setting in which a policy is trained. A decision drives from one viewpoint to another in the
table's time, and what the table shows on the way is seen on arrival. Doors follow the law of the
real task; beliefs are `ExponentialBeliefs`. Some doors are bare doorways, which never flip and do
not count, as the gaps do that a robot takes for doors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.viewpoints.exponential_beliefs import ExponentialBeliefs
from agents.viewpoints.floors import MAX_DOORS, Floors
from agents.viewpoints.situation import DoorRows, Situation
from agents.viewpoints.table import Bools
from dynslam_env.patrol.slow_doors import SlowDoors
from dynslam_env.simulation.laws import Law
from slam.geometry import Array

BUDGET = 600.0  # s, of an episode
BARE_SHARE = 0.3  # of the doors of a floor in training
MAX_FLIPS = 40  # of a door in an episode
DOORS = SlowDoors()
SAMPLES = (0.25, 0.75)  # of a decision's time, at which errors are read

Ints = NDArray[np.int64]


class Fast(NamedTuple):
    """What n policies see.

    times    (n, V) s to each viewpoint; inf: none
    sees     (n, V, D) whether a doorway is seen on that way
    between  (n, V, V) s
    doors    beliefs (n, D, ...)
    real     (n, D) whether there is a doorway in this place of the arrays
    """

    times: Array
    sees: Bools
    between: Array
    doors: DoorRows
    real: Bools


class FastPatrols:
    """n patrols, each on a floor drawn anew for each episode.

    floors  to draw from
    n       number of patrols
    rng     of floors, doors and starts
    bare    share of doors that never flip
    """

    def __init__(
        self, floors: Floors, n: int, rng: np.random.Generator, bare: float = BARE_SHARE,
        law: Law = DOORS,
    ):  # fmt: skip
        self._floors, self._rng, self._bare, self._law = floors, rng, bare, law
        self._rows = np.arange(n)
        self.floor, self.place = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.time, self.error = np.zeros(n), np.zeros(n)
        self._begin = np.zeros((n, MAX_DOORS), np.bool_)  # closed at the start
        self._flips = np.full((n, MAX_DOORS, MAX_FLIPS), np.inf)
        self._counts = np.zeros((n, MAX_DOORS))  # weight of a door in the error
        self.beliefs = ExponentialBeliefs(n, MAX_DOORS)
        for i in range(n):
            self.restart(i, int(rng.integers(len(floors.doors))))

    def restart(self, i: int, floor: int) -> None:
        """Begin an episode of patrol `i` on a floor, at any of its viewpoints."""
        rng, count = self._rng, int(self._floors.doors[floor])
        self.floor[i], self.time[i], self.error[i] = floor, 0.0, 0.0
        self.place[i] = rng.choice(np.flatnonzero(np.isfinite(self._floors.between[floor, 0])))
        self._flips[i], self._counts[i], self._begin[i] = np.inf, 0.0, False
        self._begin[i, :count] = rng.random(count) < 0.5
        leaves = rng.random(count) >= self._bare
        leaves[rng.integers(count)] = True
        self._begin[i, :count] &= leaves  # bare doorways are open
        self._counts[i, :count] = leaves / leaves.sum()
        clock, numbers = self._law.clock(int(leaves.sum()), rng), np.flatnonzero(leaves)
        filled = np.zeros(MAX_DOORS, np.int64)
        while (time := clock.next_flip) < BUDGET + 120.0:
            for door in numbers[clock.flips_until(time)]:
                self._flips[i, door, min(filled[door], MAX_FLIPS - 1)] = time
                filled[door] += 1
        self.beliefs.reset(np.array([i]))

    def seen(self) -> Fast:
        """What the policies see now."""
        then = self._floors.then[self.floor, self.place]
        between = self._floors.between[self.floor]
        real = np.arange(MAX_DOORS) < self._floors.doors[self.floor][:, None]
        return Fast(between[self._rows, self.place], then, between, self.beliefs.rows(), real)

    def situation(self, i: int, seen: Fast) -> Situation:
        """The situation of one patrol, for a policy that is no network."""
        count = int(self._floors.doors[self.floor[i]])
        kept = np.isfinite(seen.between[i, 0])
        rows = DoorRows(*(part[i, :count] for part in seen.doors))
        return Situation(
            seen.times[i, kept], seen.sees[i, kept, :count], seen.between[i][kept][:, kept],
            self._floors.then[self.floor[i]][kept][:, kept, :count], rows, int(self.place[i]),
        )  # fmt: skip

    def step(self, actions: Ints) -> tuple[Array, Array, Bools]:
        """Drive to viewpoints: error (n,) s summed over the time, s that passed (n,), and which
        episodes are over."""
        takes = self._floors.between[self.floor, self.place, actions]
        sees = self._floors.then[self.floor, self.place, actions]
        error = np.zeros(len(takes))
        for share in SAMPLES:
            p, x = self.beliefs.closed(share * takes), self.closed(self.time + share * takes)
            error += (self._counts * (p - x) ** 2).sum(axis=1) * takes / len(SAMPLES)
        self.beliefs.advance(takes)
        self.time += takes
        self.beliefs.look(sees, self.closed(self.time))
        self.place, self.error = actions.copy(), self.error + error
        over = self.time >= BUDGET
        return error, takes, over

    def restart_all(self, over: Bools) -> None:
        """Begin a new episode, on a floor drawn anew, of each patrol that is over."""
        for i in np.flatnonzero(over):
            self.restart(int(i), int(self._rng.integers(len(self._floors.doors))))

    def closed(self, times: Array) -> Bools:
        """(n, D) whether each door is closed at `times` (n,), s."""
        flips = (self._flips <= times[:, None, None]).sum(axis=-1)
        return self._begin ^ (flips % 2 == 1)
