"""Situation: what an agent knows when it chooses its next viewpoint."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from agents.viewpoints.table import Bools
from dynslam_env.navigation.door_belief import HORIZONS, DoorBelief
from slam.geometry import Array

GRID = np.arange(0.0, HORIZONS[-1] + 1.0, 5.0)  # s ahead, at which errors are summed


class DoorRows(NamedTuple):
    """The beliefs about d doorways; see `DoorBelief`.

    closed  (d,)
    age     (d,) s; inf if never seen
    leaf    (d,) whether a leaf was seen
    stale   (d, HORIZONS)
    fresh   (d, HORIZONS)
    """

    closed: Array
    age: Array
    leaf: Bools
    stale: Array
    fresh: Array

    @staticmethod
    def of(beliefs: Sequence[DoorBelief]) -> DoorRows:
        """The rows of several doorways."""
        closed, age = (np.array([getattr(one, name) for one in beliefs], dtype=np.float64)
                       for name in ("closed", "age"))  # fmt: skip
        stale, fresh = (np.array([getattr(one, name) for one in beliefs]).reshape(-1, len(HORIZONS))
                        for name in ("stale", "fresh"))  # fmt: skip
        leaf = np.array([one.leaf for one in beliefs], dtype=np.bool_)
        return DoorRows(closed, age, leaf, stale, fresh)


class Situation:
    """v viewpoints, d doorways.

    times    (v,) s from here to each viewpoint, with the look around there; inf: cannot be reached
    sees     (v, d) whether a doorway is seen on that way or there
    between  (v, v) s from one viewpoint to another
    then     (v, v, d) whether a doorway is seen on that way or there
    doors    the beliefs
    last     the viewpoint where the robot is; -1 at none
    time     s since the episode began
    frontier s to where exploring leads; inf: nowhere
    """

    def __init__(
        self, times: Array, sees: Bools, between: Array, then: Bools, doors: DoorRows, last: int,
        time: float = 0.0, frontier: float = np.inf,
    ):  # fmt: skip
        self.times, self.sees, self.between, self.then = times, sees, between, then
        self.doors, self.last, self.time, self.frontier = doors, last, time, frontier

    @property
    def around(self) -> Bools:
        """(v, d) whether a doorway is seen from a viewpoint."""
        return self.then[np.arange(len(self.times)), np.arange(len(self.times))]

    @property
    def reach(self) -> Array:
        """(v, d) s from a viewpoint until a doorway is seen."""
        return reach(self.between, self.then)

    @cached_property
    def stale(self) -> Array:
        """(d, GRID) s, expected squared error of each door's belief, summed over the time from now
        on, without a look."""
        return summed(self.doors.stale)

    @cached_property
    def fresh(self) -> Array:
        """(d, GRID) s, the same after a look now."""
        return summed(self.doors.fresh)


class ViewpointPolicy(Protocol):
    """A way to choose viewpoints; one object per episode."""

    def choose(self, situation: Situation) -> int:
        """The next viewpoint, one that can be reached; the present one to look around again; their
        number, to explore. It is asked only if a viewpoint can be reached."""
        ...


def reach(between: Array, then: Bools) -> Array:
    """(v, d) s from a viewpoint until a doorway is seen, by a table; inf if no viewpoint shows
    it."""
    return np.where(then, between[..., None], np.inf).min(axis=1, initial=np.inf)


def summed(errors: Array) -> Array:
    """(..., GRID) s, integrals from now on of errors (..., HORIZONS)."""
    return errors @ _INTEGRAL


def at(sums: Array, times: Array) -> Array:
    """(..., v, d) the integrals (..., d, GRID) up to `times` (..., v, d), s."""
    place = np.clip(times / GRID[1], 0.0, len(GRID) - 1.001)
    low = place.astype(np.int64)
    rows = np.broadcast_to(sums[..., None, :, :], (*times.shape, sums.shape[-1]))
    left = np.take_along_axis(rows, low[..., None], axis=-1)[..., 0]
    right = np.take_along_axis(rows, low[..., None] + 1, axis=-1)[..., 0]
    return left + (place - low) * (right - left)


def _integral() -> Array:
    """(HORIZONS, GRID) what integrates errors between HORIZONS, by the trapezium rule."""
    fine = np.array([np.interp(GRID, HORIZONS, row) for row in np.eye(len(HORIZONS))])
    steps = (fine[:, 1:] + fine[:, :-1]) / 2 * np.diff(GRID)
    return np.concatenate([np.zeros((len(fine), 1)), steps.cumsum(axis=1)], axis=1)


_INTEGRAL = _integral()
