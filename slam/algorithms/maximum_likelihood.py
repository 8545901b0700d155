"""Incremental maximum likelihood SLAM: equation 7 of the paper as a product of swappable parts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.geometry import Array, Pose2, wrap_angle
from slam.grid import OccupancyGrid
from slam.interface import Estimate, MapModel, Motion, Objective, Perception, Search
from slam.maps.static import Static
from slam.motion import OdometryMotion
from slam.perception.endpoint import Endpoint
from slam.scan import Scan
from slam.search.correlative import Correlative


@dataclass(frozen=True)
class Keyframes:
    """When a scan is matched: after so much way, turn or time by the odometry and the clock.

    distance m; turn rad; time s
    """

    distance: float = 0.1
    turn: float = math.radians(10.0)
    time: float = 2.0

    def due(self, moved: Pose2, waited: float) -> bool:
        """Whether `moved` or `waited` (s) since the last match ask for the next."""
        return (
            math.hypot(moved.x, moved.y) >= self.distance
            or abs(moved.theta) >= self.turn
            or waited >= self.time
        )


class MaximumLikelihood:
    """argmax_s p(z | s, h) p(s | u, s'), then the scan goes into the map, for good (equation 5, 7).

    Static and dynamic SLAM differ by one object: `grid`, the memory of what the cells have been.
    """

    def __init__(
        self,
        start: Pose2 = Pose2(),
        rng: np.random.Generator | None = None,
        *,
        grid: MapModel | None = None,
        perception: Perception | None = None,
        motion: Motion | None = None,
        search: Search | None = None,
        keyframes: Keyframes | None = None,
    ):
        self.pose = start
        self.rng = rng or np.random.default_rng(0)
        self.grid = grid or Static()
        self.perception = perception or Endpoint()
        self.motion = motion or OdometryMotion()
        self.search = search or Correlative()
        self.keyframes = keyframes or Keyframes()
        self._moved = Pose2()
        self._matched_at = -math.inf
        self._score = 0.0

    def update(self, motion: Pose2, scan: Scan) -> Estimate:
        """Move by the odometry; where the way since the last match asks for it, match and map."""
        self.pose = self.pose @ motion
        self._moved = self._moved @ motion
        covariance = self.motion.covariance(self._moved)
        if not self.keyframes.due(self._moved, scan.time - self._matched_at):
            return Estimate(self.pose, covariance, self._score, False)
        if self._matched_at > -math.inf:
            objective = self.objective(scan, self.pose, covariance)
            self.pose = self.search(objective, self.pose, covariance, self.rng)
        changed = self.grid.integrate(scan, self.pose)
        self.perception.refresh(self.grid, changed)
        self._moved, self._matched_at = Pose2(), scan.time
        return Estimate(self.pose, covariance, self._score, True)

    def objective(self, scan: Scan, predicted: Pose2, covariance: Array) -> Objective:
        """log p(z | s, h) + log p(s | u, s') of poses s, up to a constant."""
        information = 1.0 / np.diag(covariance)
        c, s = math.cos(predicted.theta), math.sin(predicted.theta)

        def log_posterior(poses: Array) -> Array:
            dx, dy = poses[:, 0] - predicted.x, poses[:, 1] - predicted.y
            dtheta = wrap_angle(poses[:, 2] - predicted.theta)
            error = np.column_stack([c * dx + s * dy, c * dy - s * dx, dtheta])
            return self.perception.log_likelihood(scan, poses) - 0.5 * error**2 @ information

        return log_posterior

    def map(self) -> OccupancyGrid:
        """h as it is now."""
        grid = self.grid
        return OccupancyGrid(grid.spec, grid.occupied.copy(), grid.observed.copy())
