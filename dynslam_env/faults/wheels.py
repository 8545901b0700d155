"""Faults of the odometry: wheels that slip, and a wrong scale."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dynslam_env.faults.fault import ANY_TIME, FaultState, Setting, Time, check_times, drawn
from slam.geometry import Array, Pose2
from slam.validation import positive, within


@dataclass(frozen=True)
class Slip:
    """The wheels slip: the odometry reports a motion that the robot did not make.

    distance  m, straight ahead or back, drawn
    turn      rad, to the left or to the right, drawn
    at        when
    duration  s; if it is one step, 0.1 s, or less, the odometry jumps between two readings
    """

    distance: float = 0.4
    turn: float = 0.0
    at: Time = ANY_TIME
    duration: float = 0.5

    def __post_init__(self) -> None:
        within(self, "distance", 0.0)
        within(self, "turn", 0.0, math.pi)
        check_times(self)

    def begin(self, rng: np.random.Generator, setting: Setting) -> FaultState:
        """See `Fault`."""
        ahead, left = rng.choice([-1.0, 1.0], 2).tolist()
        steps = max(1, round(self.duration / setting.dt))
        false = Pose2(ahead * self.distance / steps, 0.0, left * self.turn / steps)
        return _SlipState(drawn(self.at, rng), steps * setting.dt, false)


class _SlipState(FaultState):
    def __init__(self, start: float, duration: float, false: Pose2):
        super().__init__(start, duration)
        self._false = false

    def disturb_odometry(self, displacement: Array) -> None:
        if self.active:
            displacement[:] = Pose2.of(displacement) @ self._false


@dataclass(frozen=True)
class OdometryScale:
    """The odometry reports all translations `factor` times as long, as wheels of another size do.

    factor    times the translation; below 1 it is reported as too short
    at        when it begins
    duration  s; None: to the end
    """

    factor: float = 1.2
    at: Time = 0.0
    duration: float | None = None

    def __post_init__(self) -> None:
        positive(self, "factor")
        check_times(self)

    def begin(self, rng: np.random.Generator, setting: Setting) -> FaultState:
        """See `Fault`."""
        return _ScaleState(drawn(self.at, rng), self.duration, self.factor)


class _ScaleState(FaultState):
    def __init__(self, start: float, duration: float | None, factor: float):
        super().__init__(start, duration)
        self._factor = factor

    def disturb_odometry(self, displacement: Array) -> None:
        if self.active:
            displacement[:2] *= self._factor
