"""WheelEncoders: odometry from the ticks of two wheels, which turn where the robot is held."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynslam_env.sensors.odometry import MAX_DISPLACEMENT, Rows, StepMotion
from slam.geometry import Array
from slam.kernel import kernel
from slam.validation import positive, within


@dataclass(frozen=True)
class WheelEncoders:
    """Odometry that counts the ticks of the left and the right wheel.

    ```python
    env = gym.make("DoorCorridor-v0", odometry=dynslam_env.WheelEncoders(wheel_ratio=1.01))
    ```

    All errors are off by default: where nothing is touched, `WheelEncoders()` tells the true motion
    but for the rounding to ticks. Give it errors, or a SLAM has nothing to do.

    `Odometry`, the default, reports what the body did; this reports what the wheels did. They turn
    while the robot pushes a wall. (Slowly: the drive starts each step from the body's velocity, so
    that wheels of a robot that stands turn at its acceleration times 0.1 s, 0.03 m/s.)

    ticks_per_metre  1/m, of a wheel's way. 128 a millimetre is of the order of a Pioneer 3-DX (500
                     lines, four edges each, gear 38.3 : 1, wheels of 195 mm: 125 a millimetre)
    wheel_ratio      diameter of the right wheel over that of the left; the odometry takes both for
                     their mean
    base_ratio       distance between the wheels over that which the odometry assumes
    slip             share by which the wheels turn farther than the way made
    sigma            m / sqrt(m): standard deviation of the way of a wheel after 1 m of it; its
                     variance grows with the way

    wheel_ratio and base_ratio: E_d and E_b of Borenstein and Feng (1996), Measurement and
    correction of systematic odometry errors in mobile robots. sigma: Chong and Kleeman (1997),
    Accurate odometry and error modelling for a mobile robot.
    """

    ticks_per_metre: float = 128_000.0
    wheel_ratio: float = 1.0
    base_ratio: float = 1.0
    slip: float = 0.0
    sigma: float = 0.0

    def __post_init__(self) -> None:
        positive(self, "ticks_per_metre", "wheel_ratio", "base_ratio")
        within(self, "slip", 0.0)
        within(self, "sigma", 0.0)

    def sensor(self, n: int, wheel_base: float) -> TickCounters:
        """See `OdometryModel`."""
        return TickCounters(self, n, wheel_base)


class TickCounters:
    """The counters of the wheels of n robots; see `OdometrySensor`."""

    def __init__(self, encoders: WheelEncoders, n: int, wheel_base: float):
        ratio, turned = encoders.wheel_ratio, 1.0 + encoders.slip
        left, right = turned * (1.0 + ratio) / 2, turned * (1.0 + ratio) / (2 * ratio)
        assumed_base = wheel_base / encoders.base_ratio
        self._settings = np.array(
            [wheel_base, assumed_base, encoders.ticks_per_metre, encoders.sigma]
        )
        self._scales = np.array([left, right])
        self._ways, self._ticks = np.zeros((n, 2)), np.zeros((n, 2))

    def reset(self, i: int) -> None:
        """See `OdometrySensor`."""
        self._ways[i] = self._ticks[i] = 0.0

    def read(
        self, which: Rows, motion: StepMotion, noise: Array, displacements: Array,
        observed: NDArray[np.float32],
    ) -> None:  # fmt: skip
        """See `OdometrySensor`; a step uses two of the three numbers."""
        _count(which, motion.rolled, noise, self._settings, self._scales,
               self._ways, self._ticks, displacements, observed)  # fmt: skip


@kernel
def _count(which, rolled, noise, settings, scales, ways, ticks, displacements, observed):
    """Add the ways of the wheels, and drive the arc of their new ticks.

    ways   (n, 2) m since the reset, left and right
    ticks  (n, 2) whole numbers, of the ways before the step
    """
    base, assumed_base, per_metre, sigma = settings
    for i in which:
        new = np.zeros(2)
        for k in range(2):
            way = rolled[i, 0] + (k - 0.5) * base * rolled[i, 1]
            ways[i, k] += scales[k] * way + noise[i, k] * sigma * math.sqrt(abs(way))
            count = np.floor(ways[i, k] * per_metre)
            new[k] = (count - ticks[i, k]) / per_metre
            ticks[i, k] = count
        turn, ahead = (new[1] - new[0]) / assumed_base, (new[0] + new[1]) / 2
        half = turn / 2
        chord = ahead * math.sin(half) / half if half else ahead
        displacements[i, 0], displacements[i, 1] = chord * math.cos(half), chord * math.sin(half)
        displacements[i, 2] = turn - math.tau * np.rint(turn / math.tau)
        for k in range(3):
            most = MAX_DISPLACEMENT[k]
            observed[i, k] = min(max(displacements[i, k], -most), most)
