"""Fault: what goes wrong in an episode, when, and what it changes of odometry, scan and pose."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from dynslam_env.sensors.laser import Laser
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.validation import positive

Time = float | tuple[float, float]
"""A time in s since the reset, or the earliest and the latest between which it is drawn."""

TIME_TOLERANCE = 1e-6  # s, of times that are whole numbers of steps
ANY_TIME: Time = (10.0, 30.0)  # s, in which an event happens unless the user says when


class Setting(NamedTuple):
    """What a fault may know of the environment.

    laser  the laser that it disturbs
    dt     s, duration of a step
    """

    laser: Laser
    dt: float


class Surroundings(NamedTuple):
    """The robot in its world before a step.

    pose        of the robot, true
    radius      m, of the robot
    segments    (n, 4) m, everything solid: walls, then the edges of leaves and people
    first_edge  number of walls
    path        (p, 2) m, waypoints of the layout
    """

    pose: Pose2
    radius: float
    segments: Array
    first_edge: int
    path: Array


class FaultState:
    """A fault during one episode. A kind of fault overrides what it changes.

    A step that ends at time t, s, is changed if start <= t < start + duration.

    active  whether it acts in the current step
    since   s, end of the first step of its last occurrence; NaN before
    blinds  whether no scan arrives while it is active
    late    steps ago at which the scan of the current step was taken
    """

    blinds = False
    late = 0

    def __init__(self, start: float, duration: float | None):
        """`duration`: s; None: to the end of the episode."""
        self.active, self.since = False, math.nan
        self._start = start - TIME_TOLERANCE
        self._end = math.inf if duration is None else self._start + duration

    def advance(self, time: float) -> None:
        """Begin the step that ends at `time`, s."""
        before, self.active = self.active, self._start <= time < self._end
        if self.active and not before:
            self.since = time

    def carry(self, here: Surroundings, time: float) -> Pose2 | None:
        """The pose to which the robot is carried before the step that ends at `time`, s; None: it
        stays."""
        return None

    def disturb_odometry(self, displacement: Array) -> None:
        """Change the displacement (3,), m, m, rad, that the odometry reports of this step."""

    def disturb_scan(self, ranges: Array) -> None:
        """Change the scan (beams,), m, of this step: inf is no echo, NaN no reading."""


@runtime_checkable
class Fault(Protocol):
    """Something that goes wrong. It has no state: one object serves any number of episodes.

    ```python
    class Blinded(dynslam_env.FaultState):  # the sun stands low: beams to the left report no echo
        def disturb_scan(self, ranges):
            if self.active:
                ranges[len(ranges) // 2 :] = float("inf")

    class Sun:
        def begin(self, rng, setting):
            return Blinded(start=rng.uniform(10.0, 20.0), duration=5.0)

    env = gym.make("DoorCorridor-v0", faults=[Sun()])
    ```
    """

    def begin(self, rng: np.random.Generator, setting: Setting) -> FaultState:
        """The fault in a new episode; all its randomness comes from `rng`."""
        ...


def check_times(fault: Any) -> None:
    """Check the fields `at` and, if there is one, `duration` of a fault."""
    at = fault.at
    bounds = at if isinstance(at, tuple | list) else (at, at)
    if not (len(bounds) == 2 and all(map(_is_time, bounds)) and bounds[0] <= bounds[1]):
        raise InputError(
            f"{type(fault).__name__}.at must be a time in s of at least 0, or a pair (earliest, "
            f"latest) between which it is drawn, got {at!r}"
        )
    if isinstance(at, list):
        object.__setattr__(fault, "at", tuple(at))
    if getattr(fault, "duration", None) is not None:
        positive(fault, "duration")


def drawn(at: Time, rng: np.random.Generator) -> float:
    """The time itself, s, or one drawn uniformly from its range."""
    return float(rng.uniform(*at)) if isinstance(at, tuple) else float(at)


def _is_time(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return 0.0 <= value < math.inf
