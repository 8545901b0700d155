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
class Spacing:
    """How far apart two events are: after so much way, turn or time, whichever comes first.

    distance m; turn rad; time s
    """

    distance: float
    turn: float
    time: float

    def due(self, moved: Pose2, waited: float) -> bool:
        """Whether having `moved` or `waited` (s) since the last one asks for the next."""
        return (
            math.hypot(moved.x, moved.y) >= self.distance
            or abs(moved.theta) >= self.turn
            or waited >= self.time
        )


MATCHES = Spacing(distance=0.03, turn=math.radians(2.0), time=2.0)
KEYFRAMES = Spacing(distance=0.1, turn=math.radians(10.0), time=2.0)


class MaximumLikelihood:
    """argmax_s p(z | s, h) p(s | u, s'), then the scan goes into the map, for good (eq. 5 and 7).

    Static and dynamic SLAM differ by one object: `grid`, the memory of what the cells have been.
    The robot finds itself in the map at every `matches`, and adds to the map at every `keyframes`,
    which lie farther apart: whatever is put into the map brings its pose error with it.
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
        matches: Spacing = MATCHES,
        keyframes: Spacing = KEYFRAMES,
    ):
        self.rng = rng or np.random.default_rng(0)
        self.grid = grid or Static()
        self.perception = perception or Endpoint()
        self.motion = motion or OdometryMotion()
        self.search = search or Correlative()
        self.matches = matches
        self.keyframes = keyframes
        self.pose = start
        self._matched = Estimate(start, np.zeros((3, 3)), 0.0, False)
        self._matched_at = self._mapped_at = -math.inf
        self._mapped = start
        self._moved = Pose2()

    def update(self, motion: Pose2, scan: Scan) -> Estimate:
        """Move by the odometry; match where that has led far enough; map where it is time to."""
        self._moved = self._moved @ motion
        predicted = self._matched.pose @ self._moved
        deviations = self.motion.deviations(self._moved)
        if not self.matches.due(self._moved, scan.time - self._matched_at):
            return self._dead_reckoned(predicted, deviations)
        estimate = self._match(scan, predicted, deviations)
        self.pose, self._matched, self._moved = estimate.pose, estimate, Pose2()
        self._matched_at = scan.time
        if self.keyframes.due(self._mapped.between(self.pose), scan.time - self._mapped_at):
            changed = self.grid.integrate(scan, self.pose)
            self.perception.refresh(self.grid, changed)
            self._mapped, self._mapped_at = self.pose, scan.time
        return estimate

    def _match(self, scan: Scan, predicted: Pose2, deviations: Array) -> Estimate:
        """Equation 7, over the map as it was before this scan; the first scan finds none."""
        if self._mapped_at == -math.inf:
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
        covariance = self._matched.covariance + (turn * deviations**2) @ turn.T
        return Estimate(predicted, covariance, self._matched.score, False)

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
