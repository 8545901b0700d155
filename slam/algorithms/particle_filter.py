"""Rao-Blackwellised particle filter: each particle has a path and the map conditioned on it.

Grisetti, Stachniss and Burgard (2007), with any map model: what the paper proposes for loops.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slam.algorithms.maximum_likelihood import MATCHES
from slam.algorithms.pose_covariance import MapUncertainty, moved
from slam.algorithms.resampling import effective, normalised, systematic
from slam.errors import InputError
from slam.geometry import Array, Pose2, compose, wrap_angle
from slam.grid import OccupancyGrid
from slam.interface import Estimate, MapModel, MotionModel, Posterior, SensorModel, Slope
from slam.maps.cells import Cells
from slam.maps.static import Static
from slam.maps.tiles import TileIndex
from slam.motion.adaptive import AdaptiveOdometry
from slam.motion.gaussian import Prediction
from slam.motion.threshold import KEYFRAMES, MotionThreshold, MotionTrigger
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.search.laplace import laplace
from slam.sensor_models.endpoint import Endpoint
from slam.validation import positive_number, whole_number


class ParticleFilter:
    """p(path, map | scans, odometry) by particles, each a path and its map.

    At a keyframe every particle finds the peak of its own posterior (equation 7), draws its pose
    from the Gaussian around it (the improved proposal), and is weighted by the evidence of the
    scan, the volume of the posterior there. The best particle searches exhaustively; the others
    climb from its result, applied to their own prediction. If the effective number of particles
    falls below `resample` of them, they are resampled. Scans between keyframes are matched by the
    best particle alone.

    The maps of the particles share tiles; a tile is copied when a particle writes to it.

    particles  number of particles
    resample   resample below this effective share of the particles
    spread     factor on the standard deviation of the proposal; 1 is the textbook filter, which
               assumes independent errors of the scans: scans that are matched with the same walls
               have correlated errors, and 30 particles are too few for so much noise
    """

    def __init__(
        self,
        start: Pose2 = Pose2(),
        rng: np.random.Generator | None = None,
        *,
        map_model: MapModel | None = None,
        sensor_model: SensorModel | None = None,
        motion_model: MotionModel | None = None,
        search: Correlative | None = None,
        particles: int = 30,
        resample: float = 0.5,
        spread: float = 0.1,
        matches: MotionThreshold = MATCHES,
        keyframes: MotionThreshold = KEYFRAMES,
    ):
        whole_number("particles", particles, 1)
        positive_number("spread", spread)
        self.rng = np.random.default_rng(0) if rng is None else rng
        self.map_model = Static() if map_model is None else map_model
        self.sensor_model = Endpoint() if sensor_model is None else sensor_model
        self.motion_model = AdaptiveOdometry() if motion_model is None else motion_model
        self.search = Correlative() if search is None else search
        if self.search.refine.levels > 1:  # coarser fields are kept for one map only
            raise InputError(
                f"ParticleFilter.search must refine on the finest field alone (levels=1), "
                f"got levels={self.search.refine.levels}"
            )
        self.particles = particles
        self.resample = resample
        self.spread = spread
        self.matches = matches
        self.keyframes = keyframes
        self.pose = start
        self._poses = np.tile(np.array(start), (particles, 1))
        self._log_weights = np.zeros(particles)
        self._maps: list[TileIndex] = []
        self._map_uncertainty = MapUncertainty(self.map_model.cells.tiles)
        self._covariance = np.zeros((3, 3))  # of the best particle's last keyframe
        self._best = 0
        self._history: list[Array] = []  # (particles, 3) poses at each keyframe
        self._parents: list[np.ndarray] = []  # (particles,) index in the keyframe before
        self._numbers: list[int] = []  # per update: last keyframe, displacement from it
        self._ways: list[Pose2] = []
        self._since_keyframe = MotionTrigger(keyframes)
        self._since_match = MotionTrigger(matches)
        self._last = Estimate(start, np.zeros((3, 3)), 0.0, False)

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Move by the odometry; match the scan beyond `matches`, and map it beyond `keyframes`."""
        scan = replace(scan)  # a copy: its cached properties are freed with it
        self._since_keyframe.move(displacement)
        self._since_match.move(displacement)
        if not self._maps:
            estimate = self._begin(scan)
        elif self._since_keyframe.due(scan.time):
            estimate = self._keyframe(scan)
        elif self._since_match.due(scan.time):
            estimate = self._match(scan)
        else:
            estimate = self._dead_reckoned()
        self._numbers.append(len(self._history) - 1)
        self._ways.append(Pose2.of(self._poses[self._best]).between(estimate.pose))
        self.pose = estimate.pose
        return estimate

    def finish(self) -> None:
        """Nothing to do: no work is deferred."""

    def trajectory(self) -> Array:
        """(n, 3) the pose of every update so far, on the path of the current best particle."""
        if not self._numbers:
            return np.zeros((0, 3))
        path, particle = np.empty((len(self._history), 3)), self._best
        for k in range(len(path) - 1, -1, -1):
            path[k] = self._history[k][particle]
            particle = self._parents[k][particle]
        return compose(path[self._numbers], np.array(self._ways))

    def map(self) -> OccupancyGrid:
        """The map of the best particle."""
        return self._best_cells().grid()

    def sample(self, points: Array) -> tuple[Array, np.ndarray]:
        """(n,) h of the best particle's cells that hold points (n, 2), m, and whether they were
        observed."""
        return self._best_cells().sample(points)

    def _best_cells(self) -> Cells:
        """The cells, those of the best particle."""
        if self._maps:
            self.map_model.cells.tiles.switch(self._maps[self._best])
        return self.map_model.cells

    # ------------------------------------------------------------------------------------------

    def _begin(self, scan: Scan) -> Estimate:
        """The first scan: all particles share one map."""
        tiles = self.map_model.cells.tiles
        pose = self.pose @ self._since_keyframe.displacement
        self._poses = np.tile(np.array(pose), (self.particles, 1))
        self._integrate(scan, pose)
        self._maps = [tiles.current, *(tiles.fork() for _ in range(self.particles - 1))]
        self._note(scan, np.arange(self.particles))
        self._last = Estimate(pose, np.zeros((3, 3)), 0.0, True)
        return self._last

    def _match(self, scan: Scan) -> Estimate:
        """Match a scan between keyframes with the best particle's map."""
        self.map_model.cells.tiles.switch(self._maps[self._best])
        displacement = self._since_keyframe.displacement
        prediction = self._prediction(Pose2.of(self._poses[self._best]), displacement)
        posterior = Posterior(self.sensor_model, scan, prediction)
        pose, peak = self.search.refine.top(posterior, self.search.best(posterior))
        covariance = self._matched(scan, prediction, pose) + self._scatter()
        self._since_match.restart(scan.time)
        self._last = Estimate(pose, covariance, _score(peak, prediction, pose, scan), True)
        return self._last

    def _dead_reckoned(self) -> Estimate:
        """The last match moved by the odometry, with the covariance propagated."""
        last = self._last
        prediction = self._prediction(last.pose, self._since_match.displacement)
        x, y = prediction.pose.x - last.pose.x, prediction.pose.y - last.pose.y
        covariance = moved(last.covariance, x, y, prediction.gaussian)
        return last._replace(pose=prediction.pose, covariance=covariance, matched=False)

    def _keyframe(self, scan: Scan) -> Estimate:
        """Move, weight and perhaps resample all particles, then integrate the scan in each map."""
        before = self._best
        score = self._propose(scan)
        weights, parents = normalised(self._log_weights), np.arange(self.particles)
        if effective(weights) < self.resample * self.particles:
            parents = systematic(weights, self.rng.random())
            self._descend(parents)
        self._best = int(np.argmax(weights[parents]))
        for branch, pose in zip(self._maps, self._poses, strict=True):
            self.map_model.cells.tiles.switch(branch)
            self._integrate(scan, Pose2.of(pose))
        revised = bool((self._history[-1][parents[self._best]] != self._history[-1][before]).any())
        self._note(scan, parents)
        covariance = self._covariance + self._scatter()
        self._last = Estimate(Pose2.of(self._poses[self._best]), covariance, score, True)
        return self._last._replace(revised=revised)

    def _integrate(self, scan: Scan, pose: Pose2) -> None:
        """Integrate the scan in the current map, at `pose`."""
        self.sensor_model.refresh(self.map_model, self.map_model.integrate(scan, pose))
        self._map_uncertainty.settle(pose, self._covariance, scan.points)

    def _propose(self, scan: Scan) -> float:
        """Draw the pose of each particle from the Gaussian around its posterior's peak, and weight
        it by the evidence (Laplace's approximation); returns the best particle's score."""
        noise, best = self.rng.standard_normal((self.particles, 3)), self._best
        error, score = np.zeros((1, 3)), 0.0
        displacement = self._since_keyframe.displacement
        for k in (best, *(k for k in range(self.particles) if k != best)):
            self.map_model.cells.tiles.switch(self._maps[k])
            prediction = self._prediction(Pose2.of(self._poses[k]), displacement)
            posterior = Posterior(self.sensor_model, scan, prediction)
            if k == best:
                start = self.search.best(posterior)
            else:
                start = Pose2.of(prediction.poses(error)[0])
            pose, peak = self.search.refine.top(posterior, start)
            root = np.linalg.cholesky(_inverse(-peak.curvature))
            if k == best:
                self._covariance = self._matched(scan, prediction, pose)
                error[0] = prediction.error(pose)
                score = _score(peak, prediction, pose, scan)
                found = Pose2.of(self._poses[k]).between(pose)
                self.motion_model.learn(displacement, found, root @ root.T)
            self._log_weights[k] += peak.value + float(np.log(np.diag(root)).sum())
            self._poses[k] = np.array(pose) + self.spread * (root @ noise[k])
        self._poses[:, 2] = wrap_angle(self._poses[:, 2])
        self._log_weights -= self._log_weights.max()
        return score

    def _descend(self, parents: np.ndarray) -> None:
        """Replace the particles by copies of those at indices `parents` (particles,)."""
        tiles, maps, given = self.map_model.cells.tiles, [], set[int]()
        for parent in parents.tolist():
            tiles.switch(self._maps[parent])
            maps.append(tiles.fork() if parent in given else tiles.current)
            given.add(parent)
        for k, branch in enumerate(self._maps):
            if k not in given:
                tiles.release(branch)
        self._maps, self._poses = maps, self._poses[parents]
        self._log_weights = np.zeros(self.particles)

    def _note(self, scan: Scan, parents: np.ndarray) -> None:
        self._history.append(self._poses.copy())
        self._parents.append(parents)
        self._since_keyframe.restart(scan.time)
        self._since_match.restart(scan.time)

    def _prediction(self, origin: Pose2, displacement: Pose2) -> Prediction:
        """The motion model's prediction of `displacement` from `origin`."""
        return Prediction(
            origin,
            self.motion_model.corrected(displacement),
            self.motion_model.deviations(displacement),
        )

    def _matched(self, scan: Scan, prediction: Prediction, pose: Pose2) -> Array:
        """(3, 3) covariance of the best particle, matched at `pose` in its map.

        As in maximum likelihood SLAM: the particles share most of their past, and so most of their
        error, which their scatter does not show.
        """
        origin = self._poses[self._best]
        x, y = prediction.pose.x - origin[0], prediction.pose.y - origin[1]
        predicted = moved(self._covariance, x, y, prediction.gaussian)
        _, information = laplace(self.sensor_model, scan, pose)
        information *= self.sensor_model.sharpness
        return self._map_uncertainty.matched(predicted, pose, scan.points, information)

    def _scatter(self) -> Array:
        """(3, 3) covariance of the particles about their mean."""
        weights = normalised(self._log_weights)
        off = self._poses - self._poses[self._best]
        off[:, 2] = wrap_angle(off[:, 2])
        off -= weights @ off
        return (weights[:, None] * off).T @ off


def _inverse(matrix: Array) -> Array:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def _score(peak: Slope, prediction: Prediction, pose: Pose2, scan: Scan) -> float:
    """The mean log-likelihood per beam: the posterior's value without the odometry term."""
    odometry = float(prediction.log_density(np.array([pose]))[0])
    return (peak.value - odometry) / max(len(scan.points), 1)
