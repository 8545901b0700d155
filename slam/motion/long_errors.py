"""How far the odometry is off after metres without a scan, as the last metres showed."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from slam.geometry import Array, Pose2

LONG = 1.5  # m, from which on a displacement is long
WINDOW = 0.75  # m, over which an error is taken
WINDOWS = 12  # of which the root mean square is taken
FEW = 4  # windows, from which on it is known
WIDTH = 2.5  # deviation by that root mean square: few windows, and the wheels may slip
LEAST = np.array([0.03, 0.03, math.radians(2.0)])  # m, m, rad, of a window


class LongErrors:
    """Learns the errors of long displacements from those of the keyframes.

    Errors of short displacements are mostly noise that does not add up; multiplied by the length
    they allow a robot that drove 4 m without a scan any heading. Those of windows count what adds
    up: a bias of wheels grows with the length, noise with its root.
    """

    def __init__(self) -> None:
        self._windows: deque[Array] = deque(maxlen=WINDOWS)
        self._restart()

    def _restart(self) -> None:
        self._driven, self._reported, self._found = 0.0, Pose2(), Pose2()

    def learn(self, reported: Pose2, found: Pose2) -> None:
        """Take in a displacement that the odometry reported, and how it was found to be."""
        step = math.hypot(reported.x, reported.y)
        if step >= LONG:
            return
        self._driven += step
        self._reported, self._found = self._reported @ reported, self._found @ found
        if self._driven >= WINDOW:
            self._windows.append(np.abs(self._reported.between(self._found)))
            self._restart()

    def deviations(self, driven: float) -> Array:
        """(3,) standard deviations of x, y in m and theta in rad after so many m, at least LONG;
        infinite as long as too little is known."""
        if len(self._windows) < FEW:
            return np.full(3, np.inf)
        squares = np.mean(np.square(self._windows), axis=0)
        squares[:2] = squares[:2].mean()
        return np.hypot(WIDTH * np.sqrt(squares), LEAST) * math.sqrt(driven / WINDOW)
