"""Patrols: hundreds of patrols at once on viewpoint tables; true poses, no scans, no driving.

The fast setting, in which a policy is trained. A patrol drives from one viewpoint to another in
the table's time, and sees doorways on the way when a laser would (`sights`), which is more than
what the table promises to the policy. Doors follow the law of the real task. Beliefs are mixtures
of memoryless laws, in closed form, in the place of `DwellLaws`. Doorways without a leaf are never
closed and do not count. Before the policy begins, a patrol drives to the nearest viewpoint where it
has not been, for 60 to 150 s, as an explorer does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.viewpoints.features import FEATURES, Ahead, Expected, describe
from agents.viewpoints.floors import MAX_DOORS, Floors
from agents.viewpoints.sights import SLICES
from agents.viewpoints.situation import DoorRows, Situation
from agents.viewpoints.table import MAX_VIEWPOINTS, Bools
from dynslam_env.navigation.door_belief import HORIZONS
from dynslam_env.patrol.dwell_laws import LOOK_ERROR, TRUST
from dynslam_env.patrol.place_doors import STILL_WITH_LEAF
from dynslam_env.patrol.slow_doors import SlowDoors
from dynslam_env.simulation.laws import Law
from slam.geometry import Array
from slam.kernel import kernel

BUDGET = 600.0  # s, of an episode
EXPLORING = (60.0, 150.0)  # s, in which a policy begins
HISTORIES = 1024  # of the doors of a floor, drawn for a segment
MEANS = (50.0, 120.0, 290.0)  # s, mean times open and closed of the laws of the beliefs
STILL_RATE = 1e-6  # 1/s, of the law that a door never flips
STILL_BARE = 0.9  # prior weight of that law for a doorway without a leaf: what a robot learns soon
DOORS = SlowDoors()

Ints = NDArray[np.int64]


class Laws(NamedTuple):
    """The h memoryless laws of the beliefs.

    rate   (h,) 1/s, at which a law forgets
    share  (h,) of the time closed
    decay  (h, HORIZONS) what is left of a deviation from `share`
    prior  (2, h) weights for doorways without and with a leaf
    """

    rate: Array
    share: Array
    decay: Array
    prior: Array


class State(NamedTuple):
    """n patrols, D doorways each.

    floor, place  (n,) indices
    time, error   (n,) s; squared error of the doors summed over the time since the policy began
    begun         (n,) s, when it did
    visited       (n, V) viewpoints where the patrol has been
    closed        (n, D) whether each door was closed at the start
    flips         (n, D, F) s; inf after the last
    weights       (n, D, h) of the laws; p (n, D, h): P(closed now) by each
    age           (n, D) s since the last look
    """

    floor: Ints
    place: Ints
    time: Array
    error: Array
    begun: Array
    visited: Bools
    closed: Bools
    flips: Array
    weights: Array
    p: Array
    age: Array


class Patrols:
    """n patrols, each on a floor drawn anew for each episode.

    floors  to draw from
    n       number of patrols
    rng     of floors, doors and starts
    law     of the doors

    state   of the patrols; features (n, V, FEATURES) what policies see; fit (n, V) viewpoints that
            can be reached
    """

    def __init__(self, floors: Floors, n: int, rng: np.random.Generator, law: Law = DOORS):
        self.floors, self._rng, self._laws = floors, rng, laws()
        self._closed, self._flips = histories(law, int(floors.leaves.max()), rng)
        shape, h = (n, MAX_DOORS), len(self._laws.rate)
        self.state = State(
            np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n), np.zeros(n), np.zeros(n),
            np.zeros((n, MAX_VIEWPOINTS), np.bool_), np.zeros(shape, np.bool_),
            np.full((*shape, self._flips.shape[2]), np.inf), np.zeros((*shape, h)),
            np.zeros((*shape, h)), np.zeros(shape),
        )  # fmt: skip
        self.features = np.zeros((n, MAX_VIEWPOINTS, FEATURES))
        self.stale, self.fresh = (np.zeros((*shape, len(HORIZONS))) for _ in range(2))
        for i in range(n):
            self.restart(i, int(rng.integers(len(floors.doors))))
        self.look()

    @property
    def fit(self) -> Bools:
        """(n, V) whether a viewpoint can be reached."""
        return np.isfinite(self.floors.between[self.state.floor, self.state.place])

    def restart(self, i: int, floor: int) -> None:
        """Begin an episode of patrol `i` on a floor, at any of its viewpoints, and explore."""
        rng, state, leaves = self._rng, self.state, int(self.floors.leaves[floor])
        state.floor[i], state.time[i], state.age[i], state.visited[i] = floor, 0.0, np.inf, False
        state.place[i] = rng.choice(np.flatnonzero(np.isfinite(self.floors.between[floor, 0])))
        state.visited[i, state.place[i]] = True
        state.closed[i], state.flips[i] = False, np.inf
        drawn = int(rng.integers(HISTORIES))
        state.closed[i, :leaves] = self._closed[drawn, :leaves]
        state.flips[i, :leaves] = self._flips[drawn, :leaves]
        state.weights[i] = self._laws.prior[(np.arange(MAX_DOORS) < leaves).astype(np.int64)]
        state.p[i] = self._laws.share
        state.begun[i] = rng.uniform(*EXPLORING)
        _explore(i, state, self.floors, self._laws)

    def step(self, actions: Ints) -> tuple[Array, Array, Bools]:
        """Drive to viewpoints: error (n,) s summed over the time, s that passed (n,), and which
        episodes are over."""
        error, takes = np.zeros(len(actions)), np.zeros(len(actions))
        _drive_all(actions, self.state, self.floors, self._laws, error, takes)
        return error, takes, self.state.time >= BUDGET

    def restart_all(self, over: Bools) -> None:
        """Begin a new episode, on a floor drawn anew, of each patrol that is over."""
        for i in np.flatnonzero(over):
            self.restart(int(i), int(self._rng.integers(len(self.floors.doors))))

    def look(self) -> None:
        """Update what policies see."""
        _describe_all(
            self.state, self.floors, self._laws, self.stale, self.fresh, self.features
        )  # fmt: skip

    def situation(self, i: int) -> Situation:
        """The situation of one patrol, for a policy that is no network."""
        floors, floor, place = self.floors, self.state.floor[i], self.state.place[i]
        kept, count = np.isfinite(floors.between[floor, 0]), int(floors.doors[floor])
        between, then = floors.between[floor][kept][:, kept], floors.then[floor][kept][:, kept]
        here = int(kept[:place].sum())
        p = (self.state.weights[i] * self.state.p[i]).sum(axis=1)
        rows = (p, self.state.age[i], self.stale[i], self.fresh[i])
        doors = DoorRows(*(part[:count] for part in rows))
        then = then[..., :count]
        return Situation(between[here], then[here], between, then, doors, here)


def laws() -> Laws:
    """The laws of the beliefs."""
    a, b = (1.0 / rows.ravel() for rows in np.meshgrid(MEANS, MEANS))
    rate, share = np.append(a + b, STILL_RATE), np.append(a / (a + b), 0.5)
    prior = [np.append(np.full(len(a), (1 - s) / len(a)), s) for s in (STILL_BARE, STILL_WITH_LEAF)]
    return Laws(rate, share, np.exp(-rate[:, None] * HORIZONS), np.array(prior))


def histories(law: Law, doors: int, rng: np.random.Generator) -> tuple[Bools, Array]:
    """Door histories, drawn from a law: whether each of `doors` doors is closed at the start
    (HISTORIES, doors), and when it flips (HISTORIES, doors, F), s; inf after the last."""
    closed = ~law.initial_states(rng.random((HISTORIES, doors)) < 0.5, rng)
    drawn = []
    for _ in range(HISTORIES):
        clock, flips = law.clock(doors, rng), [[] for _ in range(doors)]
        while (time := clock.next_flip) < BUDGET + EXPLORING[1]:
            for door in clock.flips_until(time):
                flips[door].append(time)
        drawn.append(flips)
    most = max(len(one) for flips in drawn for one in flips) + 1
    found = np.full((HISTORIES, doors, most), np.inf)
    for k, flips in enumerate(drawn):
        for door, times in enumerate(flips):
            found[k, door, : len(times)] = times
    return closed, found


@kernel
def _drive(i, target, state: State, floors: Floors, laws: Laws):
    """Patrol `i` drives to a viewpoint; the squared error of its doors, summed over the time."""
    floor, place = state.floor[i], state.place[i]
    takes = floors.between[floor, place, target]
    count, leaves, step = floors.doors[floor], floors.leaves[floor], takes / SLICES
    gone, error = np.exp(-laws.rate * step), 0.0
    for k in range(SLICES):
        state.time[i] += step
        for d in range(count):
            w, p = state.weights[i, d], state.p[i, d]
            mean = 0.0
            for h in range(len(w)):
                p[h] = laws.share[h] + (p[h] - laws.share[h]) * gone[h]
                mean += w[h] * p[h]
            state.age[i, d] += step
            closed = state.closed[i, d]
            for time in state.flips[i, d]:
                if time > state.time[i]:
                    break
                closed = not closed
            if d < leaves:
                error += (mean - closed) ** 2 / leaves * step
            if floors.sights[floor, place, target, d] >> k & 1:
                total = 0.0
                for h in range(len(w)):
                    w[h] *= max(p[h] if closed else 1.0 - p[h], LOOK_ERROR) ** TRUST
                    total += w[h]
                    p[h] = 1.0 - LOOK_ERROR if closed else LOOK_ERROR
                w /= total
                state.age[i, d] = 0.0
    state.place[i] = target
    state.visited[i, target] = True
    return error


@kernel
def _explore(i, state: State, floors: Floors, laws: Laws):
    """Patrol `i` drives to the nearest viewpoints where it has not been, until it has begun."""
    while state.time[i] < state.begun[i]:
        times, best = floors.between[state.floor[i], state.place[i]], -1
        for j in range(len(times)):
            new = np.isfinite(times[j]) and not state.visited[i, j]
            if new and (best < 0 or times[j] < times[best]):
                best = j
        if best < 0:
            break
        _drive(i, best, state, floors, laws)
    state.begun[i], state.error[i] = state.time[i], 0.0


@kernel
def _drive_all(actions, state: State, floors: Floors, laws: Laws, error, takes):
    for i in range(len(actions)):
        takes[i] = floors.between[state.floor[i], state.place[i], actions[i]]
        error[i] = _drive(i, actions[i], state, floors, laws)
        state.error[i] += error[i]


@kernel
def _expect(i, count, state: State, laws: Laws, stale, fresh):
    """Write the expected errors of a patrol's doorways, without and after a look."""
    n, h = len(HORIZONS), len(laws.rate)
    seen = np.empty((2, h))
    for d in range(count):
        w, p = state.weights[i, d], state.p[i, d]
        totals = np.zeros(2)
        for k in range(h):
            seen[0, k] = w[k] * max(1.0 - p[k], LOOK_ERROR) ** TRUST
            seen[1, k] = w[k] * max(p[k], LOOK_ERROR) ** TRUST
            totals += seen[:, k]
        now = (w * p).sum()
        for t in range(n):
            later, opened, closed = 0.0, 0.0, 0.0
            for k in range(h):
                share, left = laws.share[k], laws.decay[k, t]
                later += w[k] * (share + (p[k] - share) * left)
                opened += seen[0, k] * (share - share * left)
                closed += seen[1, k] * (share + (1.0 - share) * left)
            opened, closed = opened / totals[0], closed / totals[1]
            stale[d, t] = later * (1.0 - later)
            fresh[d, t] = (1.0 - now) * opened * (1.0 - opened) + now * closed * (1.0 - closed)


@kernel
def _describe_all(state: State, floors: Floors, laws: Laws, stale, fresh, found):
    for i in range(len(state.time)):
        floor, place = state.floor[i], state.place[i]
        count = int(floors.doors[floor])
        _expect(i, count, state, laws, stale[i], fresh[i])
        ahead = Ahead(floors.between[floor, place], floors.then[floor, place], count, place)
        describe(ahead, Expected(state.age[i], stale[i], fresh[i]), found[i])
