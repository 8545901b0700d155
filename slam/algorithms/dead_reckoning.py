"""Dead reckoning: odometry without correction, the baseline of every SLAM."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.interface import Estimate
from slam.maps.static import Static
from slam.motion.threshold import KEYFRAMES, MotionThreshold, MotionTrigger
from slam.scan import Scan


class DeadReckoning:
    """Integrates the odometry, and maps the scans at the resulting poses."""

    def __init__(self, start: Pose2 = Pose2(), keyframes: MotionThreshold = KEYFRAMES):
        self.pose = start
        self.keyframes = keyframes
        self._since_keyframe = MotionTrigger(keyframes)
        self._map_model = Static()

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Move by `displacement`; map the scan if it is a keyframe. No scan is matched."""
        self.pose = self.pose @ displacement
        self._since_keyframe.move(displacement)
        if self._since_keyframe.due(scan.time):
            self._map_model.integrate(scan, self.pose)
            self._since_keyframe.restart(scan.time)
        return Estimate(self.pose, np.zeros((3, 3)), 0.0, False)

    def map(self) -> OccupancyGrid:
        """The map of the keyframes at their odometry poses."""
        return self._map_model.cells.grid()

    def sample(self, points: Array) -> tuple[Array, np.ndarray]:
        """(n,) h of the cells that hold points (n, 2), m, and whether they were observed."""
        return self._map_model.cells.sample(points)
