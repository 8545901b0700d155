"""EpisodeFaults: all faults of one episode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dynslam_env.faults.fault import Fault, Setting, Surroundings
from dynslam_env.sensors.odometry import MAX_DISPLACEMENT
from slam.errors import InputError
from slam.geometry import Array, Pose2

Floats = NDArray[np.float32]
LIMITS = np.array(MAX_DISPLACEMENT)


class EpisodeFaults:
    """The faults of one episode; those that change the same thing act in the order of their list.

    no_scan  whether no scan arrives in the current step
    """

    def __init__(self, faults: Sequence[Fault], setting: Setting, rng: np.random.Generator):
        streams = rng.spawn(len(faults))
        self._states = [f.begin(own, setting) for f, own in zip(faults, streams, strict=True)]
        self._max_range = setting.laser.max_range
        self.no_scan = False

    def advance(self, time: float) -> None:
        """Begin the step that ends at `time`, s."""
        for state in self._states:
            state.advance(time)
        self.no_scan = any(state.active and state.blinds for state in self._states)

    def carry(self, here: Surroundings, time: float) -> Pose2 | None:
        """Where the robot is put down before the step that ends at `time`, s; None: nowhere."""
        places = [state.carry(here, time) for state in self._states]
        return next((place for place in places if place is not None), None)

    def disturb_odometry(self, displacement: Array, observed: Floats) -> None:
        """Change the displacement (3,), m, m, rad, and write the same within its bounds."""
        for state in self._states:
            state.disturb_odometry(displacement)
        observed[:] = np.clip(displacement, -LIMITS, LIMITS)

    def disturb_scan(self, ranges: Array, observed: Floats) -> None:
        """Change the ranges (beams,), m, and write the same as an observation: see `Scanner`."""
        for state in self._states:
            state.disturb_scan(ranges)
        if self.no_scan:
            ranges[:] = np.nan
        observed[:] = np.nan_to_num(ranges, nan=0.0, posinf=self._max_range)

    def late(self) -> int:
        """Steps ago at which the scan of the current step was taken."""
        return sum(state.late for state in self._states)

    def active(self) -> list[bool]:
        """Of each fault: whether it acts in the current step."""
        return [state.active for state in self._states]

    def since(self) -> list[float]:
        """Of each fault: s, end of the first step of its last occurrence; NaN before."""
        return [state.since for state in self._states]


def check_faults(faults: object) -> tuple[Fault, ...]:
    """`faults` as a tuple; raises InputError unless each is a fault."""
    allowed = "Slip, OdometryScale, Lag, Gap, WrongBeams, MissingBeams, CarriedAway"
    if not isinstance(faults, tuple | list):
        raise InputError(f"faults must be a list of faults ({allowed}), got {faults!r}")
    for fault in faults:
        if isinstance(fault, type) or not isinstance(fault, Fault):
            raise InputError(f"a fault must be one of {allowed}, got {fault!r}")
    return tuple(faults)


def names_of(faults: Sequence[Fault]) -> list[str]:
    """A name for each fault: its type, and from the second of a type on a number."""
    kinds = [type(fault).__name__ for fault in faults]
    counts = [kinds[: k + 1].count(kind) for k, kind in enumerate(kinds)]
    return [kind if n == 1 else f"{kind} {n}" for kind, n in zip(kinds, counts, strict=True)]
