"""A robot without inertia in a room of points, as a `PatrolView`."""

from __future__ import annotations

from typing import Any

import numpy as np

from dynslam_env import Robot
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from slam import Pose2, Scan
from slam.geometry import transform_points

HERE = Pose2()
ANGLES = np.radians(np.arange(-90.0, 91.0))


class Car:
    """Does at once what it is told.

    obstacles  (n, 2) m: points that its scans hit, and that it cannot enter
    """

    limits = (0.8, 1.5)
    period = 0.4

    def __init__(self, pose: Pose2 = HERE, obstacles: Any = ()):
        self.pose, self.time, self.robot = pose, 0.0, Robot()
        self._obstacles = np.array(obstacles, dtype=np.float64).reshape(-1, 2)
        self.closest = np.inf

    def snapshot(self) -> PatrolSnapshot:
        return PatrolSnapshot(
            self.time, self.pose, np.zeros((3, 3)), self.scan, self.robot, self.limits,
            self.period, self._no_map, self._no_map,
        )  # fmt: skip

    @property
    def scan(self) -> Scan:
        ranges = np.full(len(ANGLES), np.inf)
        x, y = transform_points(self.pose.inverse(), self._obstacles).T
        bearing, away = np.arctan2(y, x), np.hypot(x, y)
        beams = np.rint(np.degrees(bearing) + 90).astype(int)
        for beam, r in zip(beams, away, strict=True):
            if 0 <= beam < len(ranges):
                ranges[beam] = min(ranges[beam], r)
        return Scan(ranges, ANGLES, 8.0, 0.0, self.time)

    def _no_map(self) -> Any:
        raise AssertionError("following a path needs no map")

    def drive(self, v: float, omega: float) -> None:
        for _ in range(8):
            self.pose = self.pose @ Pose2(v * self.period / 8, 0.0, omega * self.period / 8)
            if len(self._obstacles):
                away = np.hypot(*(self._obstacles - self.pose[:2]).T).min()
                self.closest = min(self.closest, float(away))
        self.time += self.period
