"""Dead reckoning: the odometry believed to the letter. What every SLAM has to beat."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.interface import Estimate
from slam.maps.static import Static
from slam.motion.threshold import KEYFRAMES, MotionThreshold, MotionTrigger
from slam.scan import Scan


class DeadReckoning:
    """Adds up the odometry, and maps the scans where it says that they were taken."""

    def __init__(self, start: Pose2 = Pose2(), keyframes: MotionThreshold = KEYFRAMES):
        self.pose = start
        self.keyframes = keyframes
        self._since_keyframe = MotionTrigger(keyframes)
        self._map_model = Static()

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Move by `displacement`; map the scan if it is a keyframe. Nothing is ever matched."""
        self.pose = self.pose @ displacement
        self._since_keyframe.move(displacement)
        if self._since_keyframe.due(scan.time):
            self._map_model.integrate(scan, self.pose)
            self._since_keyframe.restart(scan.time)
        return Estimate(self.pose, np.zeros((3, 3)), 0.0, False)

    def map(self) -> OccupancyGrid:
        """The scans as the odometry lays them out."""
        return self._map_model.cells.grid()
