"""Incremental maximum likelihood SLAM: equation 7 of the paper as a product of swappable parts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.interface import Estimate, MapModel, Motion, Objective, Perception, Search
from slam.maps.static import Static
from slam.motion import OdometryMotion, log_prior
from slam.perception.endpoint import Endpoint
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.search.laplace import laplace_covariance


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
    """argmax_s p(z | s, h) p(s | u, s'), then the scan goes into the map, for good (eq. 5 and 7).

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
        self._last = Estimate(start, np.zeros((3, 3)), 0.0, False)
        self._matched_at = -math.inf

    def update(self, motion: Pose2, scan: Scan) -> Estimate:
        """Move by the odometry; where the way since the last match asks for it, match and map."""
        self._moved = self._moved @ motion
        predicted = self._last.pose @ self._moved
        deviations = self.motion.deviations(self._moved)
        if not self.keyframes.due(self._moved, scan.time - self._matched_at):
            return self._dead_reckoned(predicted, deviations)
        estimate = self._matched(scan, predicted, deviations)
        changed = self.grid.integrate(scan, estimate.pose)
        self.perception.refresh(self.grid, changed)
        self.pose, self._last = estimate.pose, estimate
        self._moved, self._matched_at = Pose2(), scan.time
        return estimate

    def _matched(self, scan: Scan, predicted: Pose2, deviations: Array) -> Estimate:
        """Equation 7, over the map as it was before this scan."""
        if self._matched_at == -math.inf:
            return Estimate(predicted, np.zeros((3, 3)), 0.0, True)
        objective = self.objective(scan, predicted, deviations)
        pose = self.search(objective, predicted, deviations, self.rng)
        covariance = laplace_covariance(objective, pose, deviations)
        likelihood = self.perception.log_likelihood(scan, np.array([pose]))[0]
        return Estimate(pose, covariance, likelihood / max(len(scan.points), 1), True)

    def _dead_reckoned(self, predicted: Pose2, deviations: Array) -> Estimate:
        """Where the odometry leads from the last match, and as much less sure."""
        self.pose = predicted
        c, s = math.cos(predicted.theta), math.sin(predicted.theta)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        covariance = self._last.covariance + (turn * deviations**2) @ turn.T
        return Estimate(predicted, covariance, self._last.score, False)

    def objective(self, scan: Scan, predicted: Pose2, deviations: Array) -> Objective:
        """log p(z | s, h) + log p(s | u, s') of poses s, up to a constant."""
        centre = np.array(predicted)

        def log_posterior(poses: Array) -> Array:
            likelihood = self.perception.log_likelihood(scan, poses)
            return likelihood + log_prior(poses, centre, deviations)

        return log_posterior

    def map(self) -> OccupancyGrid:
        """h as it is now."""
        grid = self.grid
        return OccupancyGrid(grid.spec, grid.occupied.copy(), grid.observed.copy())
