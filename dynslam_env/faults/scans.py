"""Faults of the laser: late scans, missing scans, wrong beams, beams without an echo."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from dynslam_env.faults.fault import ANY_TIME, FaultState, Setting, Time, check_times, drawn
from dynslam_env.sensors.laser import Laser
from slam.geometry import Array
from slam.validation import positive, within


@dataclass(frozen=True)
class Lag:
    """The scan of a step is that of `delay` s ago, beside the odometry of now.

    Before `delay` s have passed it is the oldest one since the reset. In a recording, the true pose
    of a scan is that at which it was taken.

    delay     s, rounded to whole steps
    at        when it begins
    duration  s; None: to the end
    """

    delay: float = 0.2
    at: Time = 0.0
    duration: float | None = None

    def __post_init__(self) -> None:
        within(self, "delay", 0.0, 60.0)
        check_times(self)

    def begin(self, rng: np.random.Generator, setting: Setting) -> FaultState:
        """See `Fault`."""
        steps = round(self.delay / setting.dt)
        return _LagState(drawn(self.at, rng), self.duration, steps)


class _LagState(FaultState):
    def __init__(self, start: float, duration: float | None, steps: int):
        super().__init__(start, duration)
        self._last: deque[Array] = deque(maxlen=steps + 1)

    def disturb_scan(self, ranges: Array) -> None:
        self._last.append(ranges.copy())
        self.late = len(self._last) - 1 if self.active else 0
        if self.active:
            ranges[:] = self._last[0]


@dataclass(frozen=True)
class Gap:
    """No scan arrives for `duration` s.

    Meanwhile all beams are without a reading (0 in the observation), `SlamWrapper` does not update
    its SLAM, and a recording holds no scan; the next scan comes with the odometry since the last.

    duration  s
    at        when it begins
    """

    duration: float = 10.0
    at: Time = ANY_TIME

    def __post_init__(self) -> None:
        positive(self, "duration")
        check_times(self)

    def begin(self, rng: np.random.Generator, setting: Setting) -> FaultState:
        """See `Fault`."""
        return _GapState(drawn(self.at, rng), self.duration)


class _GapState(FaultState):
    blinds = True


@dataclass(frozen=True)
class WrongBeams:
    """Beams report random ranges, drawn anew for each scan between the laser's least and largest.

    share     probability of each beam
    at        when it begins
    duration  s; None: to the end
    """

    share: float = 0.2
    at: Time = 0.0
    duration: float | None = None

    def __post_init__(self) -> None:
        within(self, "share", 0.0, 1.0)
        check_times(self)

    def begin(self, rng: np.random.Generator, setting: Setting) -> FaultState:
        """See `Fault`."""
        return _WrongBeamsState(self, rng, setting.laser)


class _WrongBeamsState(FaultState):
    def __init__(self, fault: WrongBeams, rng: np.random.Generator, laser: Laser):
        super().__init__(drawn(fault.at, rng), fault.duration)
        self._share, self._rng = fault.share, rng
        self._least, self._most = laser.min_range, laser.max_range

    def disturb_scan(self, ranges: Array) -> None:
        if self.active:
            wrong = self._rng.random(len(ranges)) < self._share
            false = self._rng.uniform(self._least, self._most, len(ranges))
            ranges[wrong] = false[wrong]


@dataclass(frozen=True)
class MissingBeams:
    """Beams report no echo, drawn anew for each scan, as from glass or black walls.

    share     probability of each beam
    at        when it begins
    duration  s; None: to the end
    """

    share: float = 0.3
    at: Time = 0.0
    duration: float | None = None

    def __post_init__(self) -> None:
        within(self, "share", 0.0, 1.0)
        check_times(self)

    def begin(self, rng: np.random.Generator, setting: Setting) -> FaultState:
        """See `Fault`."""
        return _MissingBeamsState(self, rng)


class _MissingBeamsState(FaultState):
    def __init__(self, fault: MissingBeams, rng: np.random.Generator):
        super().__init__(drawn(fault.at, rng), fault.duration)
        self._share, self._rng = fault.share, rng

    def disturb_scan(self, ranges: Array) -> None:
        if self.active:
            ranges[self._rng.random(len(ranges)) < self._share] = np.inf
