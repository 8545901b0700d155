"""LookAhead: plans several viewpoints ahead by a beam search over saved errors per second."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.viewpoints.situation import Situation, at
from agents.viewpoints.table import Bools
from slam.geometry import Array

DEPTH = 4  # viewpoints ahead
BEAM = 12  # sequences kept
TAIL = 60.0  # s after the last look of a sequence, up to which errors count


class Beam(NamedTuple):
    """n sequences of viewpoints.

    first  (n,) the first viewpoint of each
    place  (n,) the last one
    time   (n,) s, on arrival there
    since  (n, d) s, when each doorway was looked at; negative: not in this sequence
    cost   (n, d) s, squared error of each doorway up to `since`
    """

    first: NDArray[np.int64]
    place: NDArray[np.int64]
    time: Array
    since: Array
    cost: Array


class LookAhead:
    """The first viewpoint of the sequence that saves most expected error per second.

    What `Greedy` does for one viewpoint, for up to DEPTH of them.
    """

    def choose(self, situation: Situation) -> int:
        """See `ViewpointPolicy`."""
        beam = _started(situation)
        for _ in range(DEPTH - 1):
            beam = _kept(situation, _extended(situation, beam))
        return int(beam.first[_saved(situation, beam).argmax()])


def _started(situation: Situation) -> Beam:
    reachable = np.flatnonzero(np.isfinite(situation.times))
    doors = situation.sees.shape[1]
    none = Beam(
        np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(1), np.full((1, doors), -1.0),
        np.zeros((1, doors)),
    )  # fmt: skip
    begun = _moved(situation, none, np.zeros(len(reachable), np.int64), reachable,
                   situation.times[reachable], situation.sees[reachable])  # fmt: skip
    return begun._replace(first=reachable)


def _extended(situation: Situation, beam: Beam) -> Beam:
    """The sequences, and each with each viewpoint after it."""
    n, count = len(beam.first), len(situation.times)
    rows, targets = np.repeat(np.arange(n), count), np.tile(np.arange(count), n)
    takes = situation.between[beam.place[rows], targets]
    fits = np.isfinite(takes) & np.isfinite(situation.times[targets])
    rows, targets, takes = rows[fits], targets[fits], takes[fits]
    seen = situation.then[beam.place[rows], targets]
    more = _moved(situation, beam, rows, targets, takes, seen)
    both: list[Any] = [np.concatenate(parts) for parts in zip(beam, more, strict=True)]
    return Beam(*both)


def _moved(
    situation: Situation,
    beam: Beam,
    rows: NDArray[np.int64],
    targets: NDArray[np.int64],
    takes: Array,
    seen: Bools,
) -> Beam:
    """Sequences `rows` after driving to `targets`, which takes and shows this."""
    time = beam.time[rows] + takes
    since, now = beam.since[rows], np.repeat(time[:, None], seen.shape[1], axis=1)
    added = _errors(situation, since, now)
    cost = np.where(seen, beam.cost[rows] + added, beam.cost[rows])
    return Beam(beam.first[rows], targets, time, np.where(seen, now, since), cost)


def _errors(situation: Situation, since: Array, until: Array) -> Array:
    """(n, d) s, error of each doorway from its last look to `until`."""
    stale = at(situation.stale, until)
    return np.where(since < 0.0, stale, at(situation.fresh, until - np.maximum(since, 0.0)))


def _saved(situation: Situation, beam: Beam) -> Array:
    """(n,) error saved by each sequence, over the time it takes."""
    until = np.repeat((beam.time + TAIL)[:, None], beam.since.shape[1], axis=1)
    costs = beam.cost + _errors(situation, beam.since, until)
    return (at(situation.stale, until) - costs).sum(axis=1) / beam.time


def _kept(situation: Situation, beam: Beam) -> Beam:
    best = np.argsort(-_saved(situation, beam), kind="stable")[:BEAM]
    kept: list[Any] = [part[best] for part in beam]
    return Beam(*kept)
