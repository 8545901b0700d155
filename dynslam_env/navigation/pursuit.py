"""Pure pursuit (Coulter 1992): the arc to a point of the path, and the progress along the path."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2

TURN_IN_PLACE_ANGLE = math.radians(60)  # from here on the robot turns to the target on the spot
TURN_IN_PLACE_GAIN = 1.5  # 1/s
PATH_STEP = 0.05  # m, between the points of a path that are compared with the pose


class Command(NamedTuple):
    """v in m/s and omega in rad/s."""

    v: float
    omega: float


def arc_to(pose: Pose2, target: tuple[float, float], v: float, lookahead: float) -> Command:
    """The arc at `v` m/s to `target`, m, `lookahead` m away; or a turn on the spot."""
    bearing = math.atan2(target[1] - pose.y, target[0] - pose.x) - pose.theta
    bearing = math.remainder(bearing, math.tau)
    if abs(bearing) > TURN_IN_PLACE_ANGLE:
        return Command(0.0, TURN_IN_PLACE_GAIN * bearing)
    return Command(v, 2.0 * v * math.sin(bearing) / lookahead)


class PathProgress:
    """A path and the robot's progress along it.

    points     (n, 2) m, n >= 1
    distances  (n,) m along the path, from its start to each point
    travelled  m along the path, of the point nearest to the robot at the last `lookahead_point`
    """

    def __init__(self, points: Array):
        self.points = points
        steps = np.hypot(*np.diff(points, axis=0).T)
        self.distances = np.concatenate([[0.0], np.cumsum(steps)])
        self.travelled = 0.0

    @property
    def remaining(self) -> float:
        """m to the end."""
        return float(self.distances[-1]) - self.travelled

    def lookahead_point(self, pose: Pose2, lookahead: float) -> tuple[float, float]:
        """The point `lookahead` m beyond the path's nearest point, which never moves back."""
        window = min(2 * lookahead, self.remaining)
        ahead = np.arange(self.travelled, self.travelled + window + PATH_STEP / 2, PATH_STEP)
        near = self._points_at(ahead)
        self.travelled = float(ahead[np.argmin(np.hypot(*(near - pose[:2]).T))])
        x, y = self._points_at(np.array([self.travelled + lookahead]))[0].tolist()
        return x, y

    def _points_at(self, distances: Array) -> Array:
        return np.column_stack(
            [np.interp(distances, self.distances, axis) for axis in self.points.T]
        )
