"""Pure pursuit (Coulter 1992): the arc to a point on the path, and the path of a plan."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2

TURN_FIRST = math.radians(60)  # a target further aside than this is turned to on the spot
GAIN = 1.5  # 1/s, of the turn on the spot


class Command(NamedTuple):
    """v in m/s and omega in rad/s."""

    v: float
    omega: float


def arc_to(pose: Pose2, target: tuple[float, float], v: float, lookahead: float) -> Command:
    """The arc at `v` m/s that leads to `target`, m, `lookahead` m away; or a turn on the spot."""
    aside = math.atan2(target[1] - pose.y, target[0] - pose.x) - pose.theta
    aside = math.remainder(aside, math.tau)
    if abs(aside) > TURN_FIRST:
        return Command(0.0, GAIN * aside)
    return Command(v, 2.0 * v * math.sin(aside) / lookahead)


class PathProgress:
    """A path and how far along it the robot is.

    points  (n, 2) m, n >= 1
    along   (n,) m, of the way to each
    at      m, the foot of the robot's perpendicular at the last `carrot`
    """

    def __init__(self, points: Array):
        self.points = points
        steps = np.hypot(*np.diff(points, axis=0).T)
        self.along = np.concatenate([[0.0], np.cumsum(steps)])
        self.at = 0.0

    @property
    def left(self) -> float:
        """m to the end."""
        return float(self.along[-1]) - self.at

    def carrot(self, pose: Pose2, lookahead: float) -> tuple[float, float]:
        """The point `lookahead` m beyond the nearest of the path; the foot never goes back."""
        ahead = np.arange(self.at, self.at + min(2 * lookahead, self.left) + 0.025, 0.05)
        near = self._points_at(ahead)
        self.at = float(ahead[np.argmin(np.hypot(*(near - pose[:2]).T))])
        x, y = self._points_at(np.array([self.at + lookahead]))[0].tolist()
        return x, y

    def _points_at(self, along: Array) -> Array:
        return np.column_stack([np.interp(along, self.along, axis) for axis in self.points.T])
