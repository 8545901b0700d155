"""Incremental maximum likelihood SLAM: equation 7 of the paper as a product of swappable parts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from slam.algorithms.pose_covariance import MapUncertainty, carried, of_motion
from slam.algorithms.second_start import NO_POSES, SecondStart
from slam.geometry import Array, Pose2
from slam.graph.bulk import NO_CELLS, Bulk
from slam.grid import OccupancyGrid
from slam.interface import Estimate, MapModel, MotionModel, Posterior, Search, SensorModel
from slam.maps.outline import outlined
from slam.maps.static import Static
from slam.maps.surfaces import Surfaces
from slam.motion.adaptive import AdaptiveOdometry
from slam.motion.gaussian import Prediction
from slam.motion.threshold import KEYFRAMES, MotionThreshold, MotionTrigger
from slam.recovery.astray import Astray
from slam.recovery.drawn_before import DrawnBefore
from slam.recovery.match import Match
from slam.recovery.places import Surroundings
from slam.recovery.watch import MISPLACED, Watch
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.search.laplace import laplace
from slam.search.registration import SURFACES, Registration
from slam.sensor_models.endpoint import Endpoint

MATCHES = MotionThreshold(distance=0.01, turn=math.radians(0.5), time=2.0)
MAX_LOSS = 3.0  # nats of the log-likelihood by which a registered pose may be worse than before
BEFORE_ALL = -1e12  # s: earlier than any scan
EXACT = np.zeros((3, 3))  # covariance of a known pose


class Drawn(NamedTuple):
    """A keyframe that was integrated at a pose, and the ids (n,) of the cells that may have
    changed."""

    scan: Scan
    pose: Pose2
    changed: np.ndarray


class MaximumLikelihood:
    """argmax_s p(z | s, h) p(s | u, s'), then the scan is integrated permanently (eq. 5 and 7).

    Static and dynamic SLAM differ only in `map_model`: what it stores of each cell's history.
    Scans are integrated at `keyframes`. Scans between them, at `matches`, are matched relative to
    the last keyframe and not integrated, since each integrated scan adds its pose error to the map.

    The pose that the search finds is refined by `registration` on the surfaces that keyframes leave
    in the map; with None, or with another sensor model than `Endpoint`, it is taken as it is.

    keyframe  the estimate at the last integrated scan
    watch     tells whether the robot is lost; None: nobody does
    again     maps the first metres again if the odometry is very wrong; None: they stay
    astray    the map apart, while the robot is lost
    """

    def __init__(
        self,
        start: Pose2 = Pose2(),
        rng: np.random.Generator | None = None,
        *,
        map_model: MapModel | None = None,
        sensor_model: SensorModel | None = None,
        motion_model: MotionModel | None = None,
        search: Search | None = None,
        matches: MotionThreshold = MATCHES,
        keyframes: MotionThreshold = KEYFRAMES,
        registration: Registration | None = SURFACES,
        watch: Watch | None = None,
        again: SecondStart | None = None,
        surroundings: Callable[[], Surroundings] | None = None,
    ):
        """`surroundings`: the map in which a lost robot is searched for; None: this one."""
        self.rng = np.random.default_rng(0) if rng is None else rng
        self.map_model = Static() if map_model is None else map_model
        self._sensor_model = Endpoint() if sensor_model is None else sensor_model
        self.motion_model = AdaptiveOdometry() if motion_model is None else motion_model
        self.search = Correlative() if search is None else search
        self.registration = registration if isinstance(self._sensor_model, Endpoint) else None
        self.matches = matches
        self.keyframes = keyframes
        self.pose = start
        self._map_uncertainty = MapUncertainty(self.map_model.cells.tiles)
        self._surfaces = Surfaces(self.map_model.cells.tiles) if self.registration else None
        self.keyframe = self._matched = Estimate(start, np.zeros((3, 3)), 0.0, False)
        self._since_keyframe = MotionTrigger(keyframes)
        self._since_match = MotionTrigger(matches)
        self._frozen = False
        self._last_match: tuple[Prediction, Array] | None = None  # inputs of the last match
        self.watch = watch
        self.again = again
        self._field = self._sensor_model if isinstance(self._sensor_model, Endpoint) else Endpoint()
        self._searched = surroundings
        self._doubted: list[tuple[Scan, Estimate]] = []  # keyframes that are not integrated yet
        self._unread: Drawn | None = None  # the last one that is, until a match reads the map
        self.astray: Astray | None = None
        self._before: DrawnBefore | None = None  # from the first refresh on, if it is watched

    @property
    def sensor_model(self) -> SensorModel:
        """What scans are compared with the map by, up to its last keyframe."""
        self._catch_up()
        return self._sensor_model

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Move by the odometry; match the scan beyond `matches`, and map it beyond `keyframes`."""
        if self.again is None:
            return self.advance(displacement, scan)
        return self.again.update(self, displacement, scan)

    def advance(self, displacement: Pose2, scan: Scan) -> Estimate:
        """One update."""
        if self.astray is not None:
            return self._wander(self.astray, displacement, scan)
        self._since_keyframe.move(displacement)
        self._since_match.move(displacement)
        if self.watch is not None:
            self.watch.pace.move(displacement, scan.time)
        keyframe = self._since_keyframe.due(scan.time)
        if keyframe or self._since_match.due(scan.time):
            estimate = self._match(scan)
            if keyframe or (self.watch is not None and self.watch.surprised(scan, estimate)):
                estimate = self._checked(scan, estimate)
                self._map(scan, estimate)
            self.pose = estimate.pose
            return estimate if self.watch is None else self.watch.told(estimate)
        estimate = self._dead_reckoned()
        self.pose = estimate.pose
        if self.watch is None:
            return estimate
        return self.watch.glanced(estimate, scan, self._since_keyframe.displacement)

    def remember(
        self,
        keyframes: Iterable[tuple[Scan, Pose2]],
        score: float = 0.0,
        covariance: Array = EXACT,
    ) -> None:
        """Integrate scans at known poses, of (3, 3) `covariance`, and continue from the last."""
        self._stay()
        self._catch_up()
        bulk, before = Bulk(self.map_model), self.keyframe
        for scan, pose in keyframes:
            estimate = Estimate(pose, covariance, score, True)
            if not self._frozen:
                bulk.integrate(scan, pose)
            self._add_surfaces(scan, pose)
            self._continue_from(scan, estimate)
            self._matched = estimate
            self._since_match.restart(scan.time)
        if self.keyframe is not before:
            self._refresh(bulk.finish())
            self.pose = self.keyframe.pose

    def place(self, pose: Pose2, covariance: Array = EXACT) -> None:
        """Set the robot's pose, known with (3, 3) `covariance`; the next scan is matched there."""
        self._stay()
        if self.watch is not None:
            self.watch.placed()
        if self._before is not None:
            self._before.forget()
        estimate = Estimate(pose, covariance, self.keyframe.score, False)
        self.keyframe = self._matched = estimate
        time = min(self._since_keyframe.time, BEFORE_ALL)
        self._since_keyframe.restart(time)
        self._since_match.restart(time)
        self.pose = pose

    def freeze(self) -> None:
        """Stop mapping: from now on the robot is only localised in the map."""
        self._stay()
        self._catch_up()
        self._frozen = True

    def _stay(self) -> None:
        """From now on the first scans stay as they were mapped."""
        if self.again is not None:
            self.again.stop()

    def _match(self, scan: Scan) -> Estimate:
        """Equation 7, relative to the last keyframe; the first scan has no map to match with."""
        prediction = self._prediction(self.keyframe, self._since_keyframe.displacement)
        if self._since_keyframe.time == -math.inf:
            estimate = Estimate(prediction.pose, self.keyframe.covariance, 0.0, True)
        else:
            pose = self.search(Posterior(self.sensor_model, scan, prediction), self.rng)
            pose, likelihood, information, sharpness = self._registered(scan, prediction, pose)
            covariance = self._map_uncertainty.matched(
                self.keyframe.covariance, prediction, pose, scan.points, sharpness * information
            )
            self._last_match = prediction, information
            estimate = Estimate(pose, covariance, likelihood / max(len(scan.points), 1), True)
        self._matched = estimate
        self._since_match.restart(scan.time)
        return estimate

    def _registered(
        self, scan: Scan, prediction: Prediction, pose: Pose2
    ) -> tuple[Pose2, float, Array, float]:
        """The pose refined on the map's surfaces; log-likelihood and (3, 3) information there, and
        how sharp that is."""
        if self.registration is not None and self._surfaces is not None:
            found = self.registration(
                outlined(scan), self._surfaces, self.map_model.cells, prediction, pose
            )
            if found is not None:
                poses = np.array([[*pose], [*found[0]]])
                before, after = self.sensor_model.log_likelihood(scan, poses).tolist()
                if after >= before - MAX_LOSS:
                    return found[0], after, found[1], self.registration.sharpness
        return pose, *laplace(self.sensor_model, scan, pose), self.sensor_model.sharpness

    def _checked(self, scan: Scan, estimate: Estimate) -> Estimate:
        """The estimate of a keyframe, corrected if the odometry failed, with `lost`."""
        if self.watch is None or self._last_match is None:
            return estimate
        prediction, _ = self._last_match
        last, expected = self.keyframe.pose, self.watch.pace.expected
        match = Match(self._field, scan, last, prediction, estimate, expected)
        found, pose = estimate.pose, self.watch.corrected(match)
        if pose is not found:
            covariance = estimate.covariance
            if pose is prediction.pose:
                likelihood = float(self.sensor_model.log_likelihood(scan, np.array([pose]))[0])
                covariance = carried(self.keyframe.covariance, prediction)
            else:
                wide = self.watch.odometry.wide.around(pose)
                pose, likelihood, _, _ = self._registered(scan, wide, pose)
            score = likelihood / max(len(scan.points), 1)
            estimate = estimate._replace(pose=pose, covariance=covariance, score=score)
            self._last_match = None  # nothing to learn of the odometry
            match = match._replace(estimate=estimate)
        self.watch.judge(match, self._surroundings)
        if self._before is None:
            return estimate
        drift, corrected = self._before.take_drift(), pose is not found
        if drift is None or corrected or self.watch.doubted:
            return estimate
        self._last_match = None
        self._before.move(drift)
        self.watch.odometry.moved()
        self._doubted = [(scan, one._replace(pose=drift @ one.pose)) for scan, one in self._doubted]
        pose = drift @ estimate.pose
        return estimate._replace(pose=pose, drift=math.dist(pose[:2], estimate.pose[:2]))

    def _map(self, scan: Scan, estimate: Estimate) -> None:
        """Make the scan a keyframe, at its matched pose; the motion model learns from the match."""
        if self._last_match is not None:
            prediction, information = self._last_match
            found = self.keyframe.pose.between(estimate.pose)
            within = of_motion(prediction, information, self.keyframe.pose.theta)
            self.motion_model.learn(self._since_keyframe.displacement, found, within)
        self._doubted.append((scan, estimate))
        if self.watch is not None and self.watch.lost:
            self._get_lost(self.watch, estimate)
        elif self.watch is None or not self.watch.withheld:
            self._doubt_dropped()
            for keyframe in self._doubted:
                self._keep(*keyframe)
            self._doubted.clear()
        self.keyframe = self._matched = estimate
        self._since_keyframe.restart(scan.time)

    def _doubt_dropped(self) -> None:
        """If a doubt was dropped, or the robot goes on on new ground, all that is drawn becomes old
        ground."""
        if self._before is not None and self.watch is not None and self.watch.take_unsettled():
            self._catch_up()
            self._before.doubt()
            self.watch.open = True

    def _keep(self, scan: Scan, estimate: Estimate) -> None:
        """Integrate the keyframe; what matches read of it is computed when one does."""
        self._catch_up()
        self._unread = self._draw(scan, estimate)
        if self._before is not None and self.watch is not None:
            self._before.add(scan, estimate.pose)
            self.watch.suspected, self.watch.open = self._before.votes, self._before.open
            self.watch.arriving = self._before.arriving

    def _catch_up(self) -> None:
        """Compute what matches read of the last keyframe: its surfaces, and the sensor model."""
        if self._unread is not None:
            drawn, self._unread = self._unread, None
            self._add_surfaces(drawn.scan, drawn.pose)
            self._refresh(drawn.changed)

    def _add_surfaces(self, scan: Scan, pose: Pose2) -> None:
        if self._surfaces is not None and not self._frozen:
            self._surfaces.add(outlined(scan), pose)

    def _refresh(self, changed: np.ndarray) -> None:
        self._sensor_model.refresh(self.map_model, changed)
        if self.watch is None:
            return
        if self._field is not self._sensor_model:
            self._field.refresh(self.map_model, changed)
        if self._searched is None:
            self._before = self._before or DrawnBefore(self._field)
            self._before.note()

    def _get_lost(self, watch: Watch, estimate: Estimate) -> None:
        """Map apart from now on; the doubted keyframes are dropped."""
        self._doubted.clear()
        front = MaximumLikelihood(rng=self.rng, motion_model=self.motion_model, search=self.search)
        demands, lost = watch.demands, watch.belief.probability
        if self._frozen:
            demands = demands._replace(no_new_ground=True)
        self.astray = Astray(front, self._surroundings(), estimate.pose, lost, demands)

    def _wander(self, astray: Astray, displacement: Pose2, scan: Scan) -> Estimate:
        """The estimate of a lost robot; returns to the map where it is found there."""
        estimate = astray.update(displacement, scan)
        origin = astray.found(scan.time)
        if origin is not None:
            self._return(astray, origin)
            estimate = estimate._replace(pose=self.pose, covariance=astray.covariance)
            assert self.watch is not None
            estimate = self.watch.told(estimate)
        self.pose = estimate.pose
        return estimate

    def _return(self, astray: Astray, origin: Pose2) -> None:
        """Go on in the map, with what was mapped apart at `origin` in it."""
        self.astray = None
        if self.watch is not None:
            self.watch.found(astray.sure)
        if self._before is not None and astray.sure:
            self._before.settle()
        self._doubt_dropped()
        self.remember(
            ((one.scan, origin @ one.pose) for one in astray.keyframes),
            self._matched.score,
            astray.covariance,
        )
        self.place(origin @ astray.pose, astray.covariance)

    def _surroundings(self) -> Surroundings:
        """The map in which a lost robot is searched for: this one, if no other was given; as it was
        before, if the robot has drawn over it."""
        if self._searched is not None:
            return self._searched()
        if self._before is not None and self._before.votes >= MISPLACED:
            return Surroundings(self._before.endpoint, Pose2())
        return Surroundings(self._field, Pose2())

    def _draw(self, scan: Scan, estimate: Estimate) -> Drawn:
        """Integrate the keyframe."""
        changed = NO_CELLS if self._frozen else self.map_model.integrate(scan, estimate.pose)
        self._continue_from(scan, estimate)
        return Drawn(scan, estimate.pose, changed)

    def _continue_from(self, scan: Scan, estimate: Estimate) -> None:
        """Match the next scans relative to this keyframe; a map that is not frozen holds it."""
        if not self._frozen:
            self._map_uncertainty.settle(estimate.pose, estimate.covariance, scan.points)
        self.keyframe = estimate
        self._since_keyframe.restart(scan.time)

    def _dead_reckoned(self) -> Estimate:
        """The last match moved by the odometry, with the covariance propagated."""
        prediction = self._prediction(self._matched, self._since_match.displacement)
        covariance = carried(self._matched.covariance, prediction)
        return self._matched._replace(
            pose=prediction.pose, covariance=covariance, matched=False, drift=0.0
        )

    def _prediction(self, origin: Estimate, displacement: Pose2) -> Prediction:
        """The motion model's prediction of `displacement` from `origin`."""
        return Prediction(
            origin.pose,
            self.motion_model.corrected(displacement),
            self.motion_model.deviations(displacement),
        )

    @property
    def first_poses(self) -> Array:
        """(n, 3) poses of the first n updates, if they were mapped again; else (0, 3)."""
        return NO_POSES if self.again is None else self.again.poses

    def map(self) -> OccupancyGrid:
        """The current occupancy h of every cell."""
        return self.map_model.cells.grid()

    def sample(self, points: Array) -> tuple[Array, np.ndarray]:
        """(n,) h of the cells that hold points (n, 2), m, and whether they were observed."""
        return self.map_model.cells.sample(points)
