"""Dead reckoning: the odometry believed to the letter. What every SLAM has to beat."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.interface import Estimate
from slam.maps.static import Static
from slam.scan import Scan


class DeadReckoning:
    """Adds up the odometry and maps the scans where it says they were taken."""

    def __init__(self, start: Pose2, spacing: float = 0.1):
        self.pose = start
        self.spacing = spacing
        self._mapped_at: Pose2 | None = None
        self._grid = Static()

    def update(self, motion: Pose2, scan: Scan) -> Estimate:
        """Move by `motion`; map the scan if the robot has come `spacing` m since the last."""
        self.pose = self.pose @ motion
        if self._mapped_at is None or self._far(self._mapped_at.between(self.pose)):
            self._grid.integrate(scan, self.pose)
            self._mapped_at = self.pose
        return Estimate(self.pose, np.zeros((3, 3)), 0.0, False)

    def _far(self, moved: Pose2) -> bool:
        return moved.x**2 + moved.y**2 >= self.spacing**2 or abs(moved.theta) >= self.spacing

    def map(self) -> OccupancyGrid:
        """The scans as the odometry lays them out."""
        return OccupancyGrid(self._grid.spec, self._grid.occupied, self._grid.observed)
