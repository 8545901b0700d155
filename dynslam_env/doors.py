"""When doors open and close, and where their leaves stand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit

from dynslam_env.layout import Door
from slam.checked import one_of, positive, within
from slam.errors import InputError
from slam.geometry import Array


@dataclass(frozen=True)
class Doors:
    """How doors behave.

    law          "moving": each door flips after U(dwell_min, dwell_max); "static": none ever moves
    dwell_min    s, shortest time from one flip to the next
    dwell_max    s, longest
    open_share   probability that a door is open at the beginning
    open_angle   rad, of an open door
    swing_time   s, from closed to open at full speed
    torque       N m, of whoever moves the door, and of its resistance when it is pushed
    mass         kg, of a leaf
    """

    law: str = "moving"
    dwell_min: float = 5.0
    dwell_max: float = 20.0
    open_share: float = 0.5
    open_angle: float = math.pi / 2
    swing_time: float = 1.5
    torque: float = 8.0
    mass: float = 10.0

    def __post_init__(self) -> None:
        one_of("Doors.law", self.law, ("moving", "static"))
        positive(self, "dwell_min", "dwell_max", "open_angle", "swing_time", "torque", "mass")
        within(self, "open_share", 0.0, 1.0)
        within(self, "open_angle", 0.0, math.pi / 2)
        if self.dwell_min > self.dwell_max:
            raise InputError(
                f"Doors need dwell_min <= dwell_max, got {self.dwell_min:g} > {self.dwell_max:g} s"
            )


class Schedule(Protocol):
    """Which doors are to change, and when."""

    def due(self, time: float) -> Sequence[int]:
        """The doors that flip between the last call and `time`, s (a door twice: named twice)."""
        ...


class UniformDwell:
    """Every door flips after a time of its own, drawn anew from U(dwell_min, dwell_max)."""

    def __init__(self, doors: Doors, count: int, rng: np.random.Generator):
        self._dwell = doors.dwell_min, doors.dwell_max
        self._rng = rng
        self._next = rng.uniform(*self._dwell, count).tolist()
        self._soonest = min(self._next, default=math.inf)

    def due(self, time: float) -> list[int]:
        """The doors to flip, in the order of their times."""
        flips = []
        while self._soonest <= time:
            door = self._next.index(self._soonest)
            self._next[door] += self._rng.uniform(*self._dwell)
            self._soonest = min(self._next)
            flips.append(door)
        return flips


class Never:
    """Static doors."""

    def due(self, time: float) -> tuple[int, ...]:
        """None, ever."""
        return ()


def schedule(doors: Doors, count: int, rng: np.random.Generator) -> Schedule:
    """The law of `doors` for `count` of them."""
    return UniformDwell(doors, count, rng) if doors.law == "moving" else Never()


class Leaves:
    """The outlines of all leaves of a layout, as functions of their angles."""

    def __init__(self, doors: Sequence[Door]):
        self._hinges = np.array([door.hinge for door in doors]).reshape(-1, 2)
        self._corners = np.array([door.corners for door in doors]).reshape(-1, 4, 2)

    def outline(self, angles: Sequence[float], out: Array) -> Array:
        """Write the edges (4 d, 4), m, of leaves at world `angles` (d,), rad, into `out`."""
        if len(angles):
            _outline(self._hinges, self._corners, np.asarray(angles, dtype=np.float64), out)
        return out


@njit(cache=True, nogil=True)
def _outline(hinges, corners, angles, out):
    for d in range(len(angles)):
        c, s = math.cos(angles[d]), math.sin(angles[d])
        for k in range(4):
            x, y = corners[d, k]
            x, y = hinges[d, 0] + c * x - s * y, hinges[d, 1] + s * x + c * y
            before = 4 * d + (k + 3) % 4
            out[4 * d + k, 0] = out[before, 2] = x
            out[4 * d + k, 1] = out[before, 3] = y
