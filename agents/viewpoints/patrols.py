"""Patrols: hundreds of patrols at once on viewpoint tables; true poses, no scans, no driving.

The fast setting, in which a policy is trained. A patrol begins on a floor that it does not know.
It drives from one viewpoint to another in the table's time, and sees doorways on the way when a
laser would (`sights`), which is more than what the table promises to the policy. What it has not
seen it does not know: doorways, and viewpoints that were not in sight of one where it has been. To
explore is to drive to the nearest viewpoint where it has not been, nor seen it from near. What a
viewpoint did not show is not promised there for a while, as on the robot (`missed`).

Doors follow the law of the real task. Beliefs are those of `PlaceDoors` with a part of its laws:
each doorway's filters, and weights of the laws that are learned from all doorways. Doorways without
a leaf are never closed and do not count in the error.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.viewpoints.features import FEATURES, Ahead, Expected, describe
from agents.viewpoints.floors import MAX_DOORS, Floors
from agents.viewpoints.laws import Laws, advance, condition, expect, is_closed, laws
from agents.viewpoints.missed import DURATION
from agents.viewpoints.sights import SLICES
from agents.viewpoints.situation import DoorRows, Situation
from agents.viewpoints.table import MAX_VIEWPOINTS, Bools
from dynslam_env.navigation.door_belief import HORIZONS
from dynslam_env.patrol.dwell_laws import PHASES, PRIOR_WEIGHT, TICK, TRUST
from dynslam_env.patrol.place_doors import BARE_DOORS, BARE_STILL_DOORS, STILL_WITH_LEAF
from dynslam_env.patrol.slow_doors import SlowDoors
from dynslam_env.simulation.laws import Law
from slam.geometry import Array
from slam.kernel import kernel

BUDGET = 600.0  # s, of an episode
HISTORIES = 1024  # of the doors of a floor, drawn for a segment
LEAF_AT_ONCE = 0.7  # share of the doors whose leaf is seen at the first look, while they are open
LEAF_TIME = 8.0  # s of the parts of ways that show another open door, mean, until its leaf is seen
NEAR = 9.0  # s, about 2 m: there is nothing to explore at viewpoints in sight and so near
EM_STEPS = 3  # after each drive
UNSEEN_ERROR = 0.25  # squared error of a door of which nothing is known
EXPLORE = MAX_VIEWPOINTS  # the action
DOORS = SlowDoors()

Ints = NDArray[np.int64]


class State(NamedTuple):
    """n patrols, D doorways each.

    floor, place  (n,) indices
    time, error   (n,) s; squared error of the doors summed over the time
    visited       (n, V) viewpoints where the patrol has been, or which it saw from near
    revealed      (n, V) viewpoints that it knows
    closed        (n, D) whether each door was closed at the start
    flips         (n, D, F) s; inf after the last
    shared        (n, h) weights of the laws of doors that flip; still (n,) share of the doorways
                  without a leaf that never do
    hidden        (n, D) s of the parts of ways that show an open door, still to come, after which
                  its leaf is known; 0 once it is, as when it is seen closed; inf without a leaf
    evidence      (n, D, h) log-likelihood of the looks, by each law
    weights       (n, D, h) of the laws
    phases        (n, D, h, P) of each
    age           (n, D) s since the last look; inf: not known
    missed        (n, V, D) s, until when a doorway is not expected to be seen from a viewpoint
    """

    floor: Ints
    place: Ints
    time: Array
    error: Array
    visited: Bools
    revealed: Bools
    closed: Bools
    flips: Array
    shared: Array
    still: Array
    hidden: Array
    evidence: Array
    weights: Array
    phases: Array
    age: Array
    missed: Array


class Patrols:
    """n patrols, each on a floor drawn anew for each episode.

    floors  to draw from
    n       number of patrols
    rng     of floors and doors
    law     of the doors

    state     of the patrols
    features  (n, V + 1, FEATURES) what policies see: the viewpoints, and EXPLORE
    fit       (n, V + 1) which of them can be chosen
    """

    def __init__(self, floors: Floors, n: int, rng: np.random.Generator, law: Law = DOORS):
        self.floors, self._rng, self._laws = floors, rng, laws()
        self._closed, self._flips = histories(law, int(floors.leaves.max()), rng)
        shape, (h, phases) = (n, MAX_DOORS), self._laws.begin.shape
        self.state = State(
            np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n), np.zeros(n),
            np.zeros((n, MAX_VIEWPOINTS), np.bool_), np.zeros((n, MAX_VIEWPOINTS), np.bool_),
            np.zeros(shape, np.bool_), np.full((*shape, self._flips.shape[2]), np.inf),
            np.zeros((n, h)), np.zeros(n), np.zeros(shape), np.zeros((*shape, h)),
            np.zeros((*shape, h)),
            np.zeros((*shape, h, phases)), np.zeros(shape),
            np.zeros((n, MAX_VIEWPOINTS, MAX_DOORS)),
        )  # fmt: skip
        self.features = np.zeros((n, MAX_VIEWPOINTS + 1, FEATURES))
        self.fit = np.zeros((n, MAX_VIEWPOINTS + 1), np.bool_)
        self.stale, self.fresh = (np.zeros((*shape, len(HORIZONS))) for _ in range(2))
        for i in range(n):
            self.restart(i, int(rng.integers(len(floors.doors))))
        self.look()

    def restart(self, i: int, floor: int) -> None:
        """Begin an episode of patrol `i` on a floor."""
        rng, state, leaves = self._rng, self.state, int(self.floors.leaves[floor])
        state.floor[i], state.time[i], state.error[i] = floor, 0.0, 0.0
        state.place[i], state.age[i] = self.floors.start[floor], np.inf
        state.missed[i] = 0.0
        state.visited[i], state.revealed[i] = False, False
        state.revealed[i, state.place[i]] = True
        state.closed[i], state.flips[i] = False, np.inf
        drawn = int(rng.integers(HISTORIES))
        state.closed[i, :leaves] = self._closed[drawn, :leaves]
        state.flips[i, :leaves] = self._flips[drawn, :leaves]
        state.shared[i], state.still[i] = self._laws.prior, BARE_STILL_DOORS / BARE_DOORS
        state.evidence[i], state.phases[i] = 0.0, self._laws.begin
        at_once, later = rng.random(leaves) < LEAF_AT_ONCE, rng.exponential(LEAF_TIME, leaves)
        state.hidden[i], state.hidden[i, :leaves] = np.inf, np.where(at_once, TICK, later)
        _weigh(i, state, self.floors.doors[floor], self._laws)

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
            self.state, self.floors, self._laws, self.stale, self.fresh, self.features, self.fit
        )  # fmt: skip

    def situation(self, i: int) -> Situation:
        """The situation of one patrol, for a policy that is no network."""
        floors, floor, place = self.floors, self.state.floor[i], self.state.place[i]
        kept, known = np.isfinite(floors.between[floor, 0]), np.isfinite(self.state.age[i])
        between = floors.between[floor][kept][:, kept]
        shown = self.state.missed[i][kept][:, known] <= self.state.time[i]
        then = floors.then[floor][kept][:, kept][..., known] & shown
        here = int(kept[:place].sum())
        times = np.where(self.fit[i, :EXPLORE][kept], between[here], np.inf)
        p = (self.state.weights[i] * self.state.phases[i, ..., PHASES:].sum(axis=-1)).sum(axis=1)
        rows = (p, self.state.age[i], self.state.hidden[i] == 0.0, self.stale[i], self.fresh[i])
        doors = DoorRows(*(part[known] for part in rows))
        frontier, _ = _frontier(i, self.state, floors)
        return Situation(
            times, then[here], between, then, doors, here, self.state.time[i], frontier
        )  # fmt: skip


def histories(law: Law, doors: int, rng: np.random.Generator) -> tuple[Bools, Array]:
    """Door histories, drawn from a law: whether each of `doors` doors is closed at the start
    (HISTORIES, doors), and when it flips (HISTORIES, doors, F), s; inf after the last."""
    closed = ~law.initial_states(rng.random((HISTORIES, doors)) < 0.5, rng)
    drawn = []
    for _ in range(HISTORIES):
        clock, flips = law.clock(doors, rng), [[] for _ in range(doors)]
        while (time := clock.next_flip) < BUDGET:
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
def _weigh(i, state: State, count, laws: Laws):
    """Weights of the laws of each doorway of a patrol, and the shared ones: a step of EM, as in
    `PlaceDoors`."""
    weights, shared, last = state.weights[i], state.shared[i], len(laws.prior) - 1
    total, still, bare = PRIOR_WEIGHT * laws.prior, BARE_STILL_DOORS, BARE_DOORS
    for d in range(count):
        leaf = state.hidden[i, d] == 0.0
        never = STILL_WITH_LEAF if leaf else state.still[i]
        for h in range(last + 1):
            before = never if h == last else (1.0 - never) * shared[h]
            weights[d, h] = before * np.exp(TRUST * state.evidence[i, d, h])
        weights[d] /= weights[d].sum()
        if np.isfinite(state.age[i, d]) and leaf:
            total[:last] += weights[d, :last]
        elif np.isfinite(state.age[i, d]):
            still, bare = still + weights[d, last], bare + 1.0
    shared[:] = total / total.sum()
    state.still[i] = still / bare


@kernel
def _drive(i, target, promised, state: State, floors: Floors, laws: Laws):
    """Patrol `i` drives to a viewpoint; the squared error of its doors, summed over the time.

    promised  whether it expects to see there what the table says; not where it explores
    """
    floor, place = state.floor[i], state.place[i]
    ticks = max(int(np.round(floors.between[floor, place, target] / SLICES / TICK)), 1)
    ticks = min(ticks, len(laws.steps) - 1)
    step, count, leaves, error = ticks * TICK, floors.doors[floor], floors.leaves[floor], 0.0
    for k in range(SLICES):
        counted = max(min(step, BUDGET - state.time[i]), 0.0)
        state.time[i] += step
        for d in range(count):
            closed = state.closed[i, d]
            for time in state.flips[i, d]:
                if time > state.time[i]:
                    break
                closed = not closed
            known = np.isfinite(state.age[i, d])
            w, phases = state.weights[i, d], state.phases[i, d]
            if known:
                advance(phases, laws.steps[ticks])
            if d < leaves:
                wrong = (is_closed(w, phases) - closed) ** 2 if known else UNSEEN_ERROR
                error += wrong / leaves * counted
            state.age[i, d] += step
            if floors.sights[floor, place, target, d] >> k & 1:
                condition(state.evidence[i, d], w, phases, closed)
                state.age[i, d] = 0.0
                left = state.hidden[i, d] - step
                state.hidden[i, d] = 0.0 if closed else max(left, 0.0)
    for d in range(count):
        promise = promised and floors.then[floor, target, target, d]
        if promise and np.isfinite(state.age[i, d]) and not floors.sights[floor, place, target, d]:
            state.missed[i, target, d] = state.time[i] + DURATION
    state.place[i] = target
    state.visited[i, target] = True
    state.revealed[i, target] = True
    for j in range(floors.reveals.shape[2]):
        in_sight = floors.reveals[floor, target, j]
        state.revealed[i, j] |= in_sight
        state.visited[i, j] |= in_sight and floors.between[floor, target, j] < NEAR
    return error


@kernel
def _frontier(i, state: State, floors: Floors):
    """s to the nearest viewpoint that a patrol has not visited, of those that it knows if there is
    one, and its number; inf and -1 if it has visited all."""
    times, near, best = floors.between[state.floor[i], state.place[i]], np.inf, -1
    for known in (True, False):
        for j in range(len(times)):
            new = not state.visited[i, j] and (state.revealed[i, j] or not known)
            if new and times[j] < near:
                near, best = times[j], j
        if best >= 0:
            break
    return near, best


@kernel
def reachable(floors: Floors, floor, known, shown):
    """(V, k) s from a viewpoint until a doorway is seen, of the `known` ones (k,), where only those
    `shown` (V, k) are to be seen from a viewpoint."""
    found = floors.reach[floor][:, known]
    for k in range(len(known)):
        if shown[:, k].all():
            continue
        for i in range(len(found)):
            found[i, k] = np.inf
            for j in range(len(found)):
                if shown[j, k] and floors.then[floor, i, j, known[k]]:
                    found[i, k] = min(found[i, k], floors.between[floor, i, j])
    return found


@kernel
def _drive_all(actions, state: State, floors: Floors, laws: Laws, error, takes):
    for i in range(len(actions)):
        chosen = actions[i] < EXPLORE
        target = actions[i] if chosen else _frontier(i, state, floors)[1]
        before = state.time[i]
        error[i] = _drive(i, target, chosen, state, floors, laws)
        takes[i] = state.time[i] - before
        for _ in range(EM_STEPS):
            _weigh(i, state, floors.doors[state.floor[i]], laws)
        state.error[i] += error[i]


@kernel
def _describe_all(state: State, floors: Floors, laws: Laws, stale, fresh, found, fit):
    for i in range(len(state.time)):
        floor, place = state.floor[i], state.place[i]
        known = np.flatnonzero(np.isfinite(state.age[i]))
        for d in known:
            expect(state.weights[i, d], state.phases[i, d], laws, stale[i, d], fresh[i, d])
        times = floors.between[floor, place].copy()
        for j in range(len(times)):
            shows = False
            for d in known:
                shows |= floors.then[floor, j, j, d]
            fit[i, j] = state.revealed[i, j] and shows and np.isfinite(times[j])
            times[j] = times[j] if fit[i, j] else np.inf
        frontier = _frontier(i, state, floors)[0]
        fit[i, EXPLORE] = np.isfinite(frontier)
        if not fit[i].any():
            fit[i, place], times[place] = True, floors.between[floor, place, place]
        shown = state.missed[i][:, known] <= state.time[i]
        sees = floors.then[floor, place][:, known] & shown
        near = reachable(floors, floor, known, shown)
        ahead = Ahead(times, sees, near, len(known), place, state.time[i], frontier)
        leaf = state.hidden[i][known] == 0.0
        expected = Expected(state.age[i][known], leaf, stale[i][known], fresh[i][known])
        describe(ahead, expected, found[i])
