"""Rao-Blackwellised particle filter: each particle has a path and the map conditioned on it.

Grisetti, Stachniss and Burgard (2007), with any map model: what the paper proposes for loops.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from slam.algorithms.maximum_likelihood import MATCHES, MaximumLikelihood
from slam.algorithms.particle_paths import ParticlePaths
from slam.algorithms.pose_covariance import MapUncertainty, carried
from slam.algorithms.resampling import effective, normalised, systematic
from slam.errors import InputError
from slam.geometry import Array, Pose2, wrap_angle
from slam.grid import OccupancyGrid
from slam.interface import Estimate, MapModel, MotionModel, Posterior, SensorModel, Slope
from slam.maps.cells import Cells
from slam.maps.static import Static
from slam.maps.tiles import TileIndex
from slam.motion.adaptive import AdaptiveOdometry
from slam.motion.gaussian import Prediction
from slam.motion.threshold import KEYFRAMES, MotionThreshold, MotionTrigger
from slam.recovery.astray import Astray
from slam.recovery.match import Match
from slam.recovery.places import Surroundings
from slam.recovery.watch import Watch
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.search.laplace import laplace
from slam.sensor_models.endpoint import Endpoint
from slam.validation import positive_number, whole_number

EXACTLY = np.full(3, 1e-3)  # m, m, rad: deviations of a motion that no scan changes


class Motion(NamedTuple):
    """The robot's motion since a keyframe, and the deviations (3,) of its error, m, m, rad."""

    way: Pose2
    deviations: Array


class Peak(NamedTuple):
    """The maximum of a particle's posterior, the posterior there, and the prediction in it."""

    prediction: Prediction
    pose: Pose2
    posterior: Slope


class ParticleFilter:
    """p(path, map | scans, odometry) by particles, each a path and its map.

    At a keyframe every particle finds the peak of its own posterior (equation 7), draws its pose
    from the Gaussian around it (the improved proposal), and is weighted by the evidence of the
    scan, the volume of the posterior there. The best particle searches exhaustively; the others
    climb from its result, applied to their own prediction. If the effective number of particles
    falls below `resample` of them, they are resampled. Scans between keyframes are matched by the
    best particle alone.

    The maps of the particles share tiles; a tile is copied when a particle writes to it.

    Whether the robot is lost is judged in the best particle's map, as in maximum likelihood SLAM.
    Where the odometry failed, all particles move as the wider search found. A robot that is lost
    maps apart until it is found in that map; then all particles go on there, at one pose.

    particles  number of particles
    resample   resample below this effective share of the particles
    spread     factor on the standard deviation of the proposal; 1 is the textbook filter, which
               assumes independent errors of the scans: scans that are matched with the same walls
               have correlated errors, and 30 particles are too few for so much noise
    paths      of the particles
    watch      tells whether the robot is lost, if the sensor model is an `Endpoint`; None: nobody
               does
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
        watch: Watch | None = None,
    ):
        whole_number("particles", particles, 1)
        positive_number("spread", spread)
        self.rng = np.random.default_rng(0) if rng is None else rng
        self.map_model = Static() if map_model is None else map_model
        self.sensor_model = Endpoint() if sensor_model is None else sensor_model
        self.motion_model = AdaptiveOdometry() if motion_model is None else motion_model
        self.search = Correlative() if search is None else search
        if watch is not None and not isinstance(self.sensor_model, Endpoint):
            raise InputError(
                f"ParticleFilter.watch reads the map by an Endpoint, got a "
                f"{type(self.sensor_model).__name__} as sensor_model"
            )
        self.particles = particles
        self.resample = resample
        self.spread = spread
        self.matches = matches
        self.keyframes = keyframes
        if watch is not None:
            watch.arriving = None  # particles are not compared with old ground, which would tell
        self.watch = watch
        self.pose = start
        self._poses = np.tile(np.array(start), (particles, 1))
        self._log_weights = np.zeros(particles)
        self._maps: list[TileIndex] = []
        self._map_uncertainty = MapUncertainty(self.map_model.cells.tiles)
        self._covariance = np.zeros((3, 3))  # of the best particle's last keyframe
        self._best = 0
        self.paths = ParticlePaths()
        self._waiting: list[Scan] = []  # the last keyframes, which are not drawn yet
        self._since_keyframe = MotionTrigger(keyframes)
        self._since_match = MotionTrigger(matches)
        self._last = Estimate(start, np.zeros((3, 3)), 0.0, False)
        self._field = Endpoint()  # by which the watch reads the best particle's map
        self.astray: Astray | None = None  # the map apart, while the robot is lost

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Move by the odometry; match the scan beyond `matches`, and map it beyond `keyframes`."""
        if self.astray is not None:
            return self._noted(self._wander(self.astray, displacement, scan))
        scan = replace(scan)  # a copy: its cached properties are freed with it
        self._since_keyframe.move(displacement)
        self._since_match.move(displacement)
        if self.watch is not None:
            self.watch.pace.move(displacement, scan.time)
        if not self._maps:
            estimate = self._begin(scan)
        elif self._since_keyframe.due(scan.time):
            estimate = self._keyframe(scan)
        elif self._since_match.due(scan.time):
            estimate = self._match(scan)
            if self.watch is not None and self.watch.surprised(scan, estimate):
                estimate = self._keyframe(scan)
        else:
            estimate = self._dead_reckoned()
        return self._noted(estimate if self.watch is None else self.watch.told(estimate))

    def finish(self) -> None:
        """Nothing to do: no work is deferred."""

    def trajectory(self) -> Array:
        """(n, 3) the pose of every update so far, on the path of the current best particle."""
        return self.paths.trajectory(self._best)

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

    def _noted(self, estimate: Estimate) -> Estimate:
        """The estimate of an update, after it was added to the trajectory."""
        self.paths.add_scan(estimate.pose, self._best)
        self.pose = estimate.pose
        return estimate

    def _begin(self, scan: Scan) -> Estimate:
        """The first scan: all particles share one map."""
        tiles = self.map_model.cells.tiles
        pose = self.pose @ self._since_keyframe.displacement
        self._set_poses(pose)
        self._integrate(scan, pose)
        if isinstance(self.sensor_model, Endpoint):
            self._field = self.sensor_model.of_layer(self.sensor_model.field())
            self._field.levels = 1  # places are refined in the finest field alone
        self._maps = [tiles.current, *(tiles.fork() for _ in range(self.particles - 1))]
        self._note(scan, np.arange(self.particles))
        self._last = Estimate(pose, np.zeros((3, 3)), 0.0, True)
        return self._last

    def _match(self, scan: Scan) -> Estimate:
        """Match a scan between keyframes with the best particle's map."""
        peak = self._best_peak(scan, self._motion(self._since_keyframe.displacement))
        covariance = self._matched(scan, peak) + self._scatter()
        self._since_match.restart(scan.time)
        self._last = Estimate(peak.pose, covariance, _score(peak, scan), True)
        return self._last

    def _dead_reckoned(self) -> Estimate:
        """The last match moved by the odometry, with the covariance propagated."""
        last = self._last
        prediction = Prediction(last.pose, *self._motion(self._since_match.displacement))
        covariance = carried(last.covariance, prediction)
        return last._replace(pose=prediction.pose, covariance=covariance, matched=False)

    def _keyframe(self, scan: Scan) -> Estimate:
        """Move, weight and perhaps resample all particles, then integrate the scan in each map, or
        let it wait if it is doubted that the robot is there."""
        before = self._best
        score = self._propose(scan)
        weights, parents = normalised(self._log_weights), np.arange(self.particles)
        if effective(weights) < self.resample * self.particles:
            parents = systematic(weights, self.rng.random())
            self._descend(parents)
        self._best = int(np.argmax(weights[parents]))
        last = self.paths.poses[-1]
        revised = bool((last[parents[self._best]] != last[before]).any())
        self._note(scan, parents)
        self._waiting.append(scan)
        if self.watch is not None and self.watch.lost:
            self._get_lost(self.watch)
        elif self.watch is None or not self.watch.withheld:
            self._draw()
        covariance = self._covariance + self._scatter()
        self._last = Estimate(Pose2.of(self._poses[self._best]), covariance, score, True)
        return self._last._replace(revised=revised)

    def _draw(self) -> None:
        """Integrate the keyframes that wait in each particle's map, at the poses of its path."""
        drawn = list(zip(self._waiting, self.paths.last(len(self._waiting)), strict=True))
        for k, branch in enumerate(self._maps):
            self.map_model.cells.tiles.switch(branch)
            for scan, poses in drawn:
                self._integrate(scan, Pose2.of(poses[k]))
        self._waiting.clear()

    def _integrate(self, scan: Scan, pose: Pose2) -> None:
        """Integrate the scan in the current map, at `pose`."""
        self.sensor_model.refresh(self.map_model, self.map_model.integrate(scan, pose))
        if isinstance(self.sensor_model, Endpoint):
            self._field.rewritten(self.sensor_model.refreshed)
        self._map_uncertainty.settle(pose, self._covariance, scan.points)

    def _propose(self, scan: Scan) -> float:
        """Draw the pose of each particle from the Gaussian around its posterior's peak, and weight
        it by the evidence (Laplace's approximation); returns the best particle's score."""
        noise, best = self.rng.standard_normal((self.particles, 3)), self._best
        leading, motion = self._leading(scan)
        error = leading.prediction.error(leading.pose)[None]
        for k in (best, *(k for k in range(self.particles) if k != best)):
            peak = leading if k == best else self._peak(k, scan, motion, error)
            root = _root(peak)
            self._log_weights[k] += peak.posterior.value + float(np.log(np.diag(root)).sum())
            self._poses[k] = np.array(peak.pose) + self.spread * (root @ noise[k])
        self._poses[:, 2] = wrap_angle(self._poses[:, 2])
        self._log_weights -= self._log_weights.max()
        return _score(leading, scan)

    def _leading(self, scan: Scan) -> tuple[Peak, Motion]:
        """The best particle's peak, and the motion of all particles: that of the odometry, from
        which the motion model learns; where it failed that of a wider search; and after a gap, if
        the map shows nearly nothing of the scan, that of the odometry, whatever the scan says."""
        displacement = self._since_keyframe.displacement
        motion, origin = self._motion(displacement), Pose2.of(self._poses[self._best])
        peak = by_odometry = self._best_peak(scan, motion)
        pose = peak.pose if self.watch is None else self.watch.corrected(self._as_match(scan, peak))
        if pose is peak.pose:
            root = _root(peak)
            self.motion_model.learn(displacement, origin.between(pose), root @ root.T)
            motion = self._motion(displacement)
        elif pose is peak.prediction.pose:
            motion = motion._replace(deviations=EXACTLY)
            peak = self._best_peak(scan, motion)
        else:
            motion = motion._replace(way=origin.between(pose))
            peak = self._best_peak(scan, motion)
        if self.watch is not None:
            match = self._as_match(scan, peak)._replace(prediction=by_odometry.prediction)
            self.watch.judge(match, self._surroundings)
        if pose is by_odometry.prediction.pose:
            self._covariance = carried(self._covariance, by_odometry.prediction)
        else:
            self._covariance = self._matched(scan, peak)
        return peak, motion

    def _as_match(self, scan: Scan, peak: Peak) -> Match:
        """The best particle's peak as the watch sees it."""
        estimate = Estimate(peak.pose, self._covariance, _score(peak, scan), True)
        origin = Pose2.of(self._poses[self._best])
        expected = None if self.watch is None else self.watch.pace.expected
        return Match(self._field, scan, origin, peak.prediction, estimate, expected)

    def _surroundings(self) -> Surroundings:
        """The best particle's map."""
        return Surroundings(self._field, Pose2())

    def _get_lost(self, watch: Watch) -> None:
        """Map apart from now on; the keyframes that wait are dropped."""
        self._waiting.clear()
        front = MaximumLikelihood(rng=self.rng, motion_model=self.motion_model, search=self.search)
        believed, lost = Pose2.of(self._poses[self._best]), watch.belief.probability
        self._best_cells()
        self.astray = Astray(front, self._surroundings(), believed, lost, watch.demands)

    def _wander(self, astray: Astray, displacement: Pose2, scan: Scan) -> Estimate:
        """The estimate of a lost robot; all particles go on in their maps where it is found."""
        self._best_cells()
        estimate = astray.update(displacement, scan)
        origin = astray.found(scan.time)
        if origin is None:
            return estimate
        assert self.watch is not None
        self.astray = None
        self.watch.found(astray.sure)
        self._covariance = astray.covariance
        for one in astray.keyframes:
            self._set_poses(origin @ one.pose)
            self._note(one.scan, np.arange(self.particles))
            self._waiting.append(one.scan)
        self._draw()
        self._set_poses(origin @ astray.pose)
        self._note(scan, np.arange(self.particles))
        pose = Pose2.of(self._poses[self._best])
        self._last = estimate._replace(pose=pose, covariance=astray.covariance)
        return self.watch.told(self._last)

    def _set_poses(self, pose: Pose2) -> None:
        self._poses = np.tile(np.array(pose), (self.particles, 1))

    def _best_peak(self, scan: Scan, motion: Motion) -> Peak:
        """The peak of the best particle's posterior, searched for exhaustively."""
        self.map_model.cells.tiles.switch(self._maps[self._best])
        prediction = Prediction(Pose2.of(self._poses[self._best]), *motion)
        posterior = Posterior(self.sensor_model, scan, prediction)
        return Peak(prediction, *self.search.refine.top(posterior, self.search.best(posterior)))

    def _peak(self, k: int, scan: Scan, motion: Motion, error: Array) -> Peak:
        """The peak of another particle's posterior, near the predicted pose with an error (1, 3) of
        the motion."""
        self.map_model.cells.tiles.switch(self._maps[k])
        prediction = Prediction(Pose2.of(self._poses[k]), *motion)
        posterior = Posterior(self.sensor_model, scan, prediction)
        start = Pose2.of(prediction.poses(error)[0])
        return Peak(prediction, *self.search.refine.top(posterior, start))

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
        self.paths.add_keyframe(self._poses, parents)
        self._since_keyframe.restart(scan.time)
        self._since_match.restart(scan.time)

    def _motion(self, displacement: Pose2) -> Motion:
        """The motion by the odometry."""
        model = self.motion_model
        return Motion(model.corrected(displacement), model.deviations(displacement))

    def _matched(self, scan: Scan, peak: Peak) -> Array:
        """(3, 3) covariance of the best particle, matched at a peak in its map.

        As in maximum likelihood SLAM: the particles share most of their past, and so most of their
        error, which their scatter does not show.
        """
        _, information = laplace(self.sensor_model, scan, peak.pose)
        information *= self.sensor_model.sharpness
        return self._map_uncertainty.matched(
            self._covariance, peak.prediction, peak.pose, scan.points, information
        )

    def _scatter(self) -> Array:
        """(3, 3) covariance of the particles about their mean."""
        weights = normalised(self._log_weights)
        off = self._poses - self._poses[self._best]
        off[:, 2] = wrap_angle(off[:, 2])
        off -= weights @ off
        return (weights[:, None] * off).T @ off


def _inverse(matrix: Array) -> Array:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def _root(peak: Peak) -> Array:
    """(3, 3) root of the covariance of a peak: of the Gaussian around it."""
    root = np.linalg.cholesky(_inverse(-peak.posterior.curvature))
    return np.asarray(root, dtype=np.float64)


def _score(peak: Peak, scan: Scan) -> float:
    """The mean log-likelihood per beam: the posterior's value without the odometry term."""
    odometry = float(peak.prediction.log_density(np.array([peak.pose]))[0])
    return (peak.posterior.value - odometry) / max(len(scan.points), 1)
