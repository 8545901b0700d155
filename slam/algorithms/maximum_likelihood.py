"""Incremental maximum likelihood SLAM: equation 7 of the paper as a product of swappable parts."""

from __future__ import annotations

import math

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
from slam.spacing import KEYFRAMES, Spacing

MATCHES = Spacing(distance=0.01, turn=math.radians(0.5), time=2.0)


class MaximumLikelihood:
    """argmax_s p(z | s, h) p(s | u, s'), then the scan goes into the map, for good (eq. 5 and 7).

    Static and dynamic SLAM differ by one object: `grid`, the memory of what the cells have been.
    Scans go into the map at `keyframes`; those between them, at `matches`, are matched from the
    last keyframe on and leave no trace, since whatever enters the map brings its error with it.
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
        self.rng = np.random.default_rng(0) if rng is None else rng
        self.grid = Static() if grid is None else grid
        self.perception = Endpoint() if perception is None else perception
        self.motion = OdometryMotion() if motion is None else motion
        self.search = Correlative() if search is None else search
        self.matches = matches
        self.keyframes = keyframes
        self.pose = start
        self._keyframe = self._matched = Estimate(start, np.zeros((3, 3)), 0.0, False)
        self._keyframe_at = self._matched_at = -math.inf
        self._since_keyframe = self._since_match = Pose2()

    def update(self, motion: Pose2, scan: Scan) -> Estimate:
        """Move by the odometry; match and map the scan where that has led far enough."""
        self._since_keyframe = self._since_keyframe @ motion
        self._since_match = self._since_match @ motion
        if self.keyframes.due(self._since_keyframe, scan.time - self._keyframe_at):
            estimate = self._match(scan)
            self._map(scan, estimate)
        elif self.matches.due(self._since_match, scan.time - self._matched_at):
            estimate = self._match(scan)
        else:
            estimate = self._dead_reckoned()
        self.pose = estimate.pose
        return estimate

    def _match(self, scan: Scan) -> Estimate:
        """Equation 7, from the last keyframe on; the first scan finds no map to be matched with."""
        predicted = self._keyframe.pose @ self._since_keyframe
        deviations = self.motion.deviations(self._since_keyframe)
        if self._keyframe_at == -math.inf:
            estimate = Estimate(predicted, np.zeros((3, 3)), 0.0, True)
        else:
            objective = self.objective(scan, predicted, deviations)
            pose = self.search(objective, predicted, deviations, self.rng)
            covariance = laplace_covariance(objective, pose, deviations)
            score = self.perception.log_likelihood(scan, np.array([pose]))[0]
            estimate = Estimate(pose, covariance, score / max(len(scan.points), 1), True)
        self._matched, self._matched_at, self._since_match = estimate, scan.time, Pose2()
        return estimate

    def _map(self, scan: Scan, estimate: Estimate) -> None:
        """Put the scan into the map, where it was matched: a keyframe."""
        changed = self.grid.integrate(scan, estimate.pose)
        self.perception.refresh(self.grid, changed)
        self._keyframe, self._keyframe_at, self._since_keyframe = estimate, scan.time, Pose2()

    def _dead_reckoned(self) -> Estimate:
        """Where the odometry leads from the last match, and as much less sure."""
        pose = self._matched.pose @ self._since_match
        c, s = math.cos(pose.theta), math.sin(pose.theta)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        spread = (turn * self.motion.deviations(self._since_match) ** 2) @ turn.T
        return self._matched._replace(
            pose=pose, covariance=self._matched.covariance + spread, matched=False
        )

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
