"""Graph SLAM: rigid local maps, and a pose graph of their frames.

Konolige et al. (2010) and Hess et al. (2016) lay out the scheme; here every local map is mapped by
maximum likelihood SLAM, and the whole one is of any map model.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator

import numpy as np

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.geometry import Array, Pose2, compose, lever_jacobian, turned
from slam.graph.chain import chained
from slam.graph.edges import Edge
from slam.graph.local_map import LocalMap
from slam.graph.loops import Loops, Matcher
from slam.graph.pose_graph import PoseGraph
from slam.graph.whole_map import WholeMap
from slam.grid import OccupancyGrid
from slam.interface import Estimate, MapModel, MotionModel, Search, SensorModel
from slam.maps.static import Static
from slam.motion.adaptive import AdaptiveOdometry
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.sensor_models.endpoint import Endpoint
from slam.validation import positive_number, whole_number

MIN_KEYFRAMES = 12  # of a stretch, where scans are far apart
MAX_MIDDLE_DISTANCE = (
    6.0  # m between the middles of two local maps, beyond which they are not matched
)
DRIFT = np.diag([0.03, 0.03, math.radians(0.5)]) ** 2  # m^2, rad^2: of a stretch, beyond what it
# knows of its errors


class GraphSlam:
    """Maps stretch after stretch of the way; where two show the same place, all are laid anew.

    Each stretch has a frame of its own, in which nothing is ever revised. The graph's poses are
    those frames, its edges where one stretch begins in the one before, and the loops: matches of a
    finished stretch with older ones, as far around as the surest chain of edges leaves in doubt.
    After a loop the graph is optimised, with a kernel that switches off what the rest contradicts.

    Every update does one piece of that work (a match, or a step of the optimisation), so that none
    takes long; where stretches follow too quickly for that, as many pieces as stretches wait.
    `finish` does what is left at the end.

    grid        makes the whole map: the memory of what the cells have been
    local       makes the map of a stretch: a few metres, in which little changes
    stretch     m of way in a local map
    seeds       keyframes that a local map begins with, the last ones of the one before
    candidates  older local maps that a finished one is matched with at most
    """

    def __init__(
        self,
        start: Pose2 = Pose2(),
        rng: np.random.Generator | None = None,
        *,
        map_model: Callable[[], MapModel] = Static,
        local: Callable[[], MapModel] = Static,
        sensor_model: Callable[[], SensorModel] = Endpoint,
        motion_model: MotionModel | None = None,
        search: Search | None = None,
        loops: Loops | None = None,
        stretch: float = 4.0,
        seeds: int = 15,
        candidates: int = 5,
    ):
        positive_number("stretch", stretch)
        whole_number("seeds", seeds, 0)
        whole_number("candidates", candidates, 0)
        self.rng = np.random.default_rng(0) if rng is None else rng
        self.map_model = map_model
        self.local = local
        self.sensor_model = sensor_model
        self.motion_model = AdaptiveOdometry() if motion_model is None else motion_model
        self.search = Correlative() if search is None else search
        self.loops = Loops() if loops is None else loops
        self.stretch = stretch
        self.seeds = seeds
        self.candidates = candidates
        self.pose = start
        self.graph = PoseGraph(np.array([start]))
        self.places: list[LocalMap] = []
        self._front: MaximumLikelihood | None = None
        self._sure = np.zeros((3, 3))  # covariance of the present stretch's frame, in that frame
        self._middles: list[Pose2] = []  # of the finished stretches, each in its frame
        self._matcher = Matcher(self.loops)
        self._whole = WholeMap(map_model)
        self._numbers: list[int] = []  # of the stretch, and the pose in it, for every update
        self._locals: list[Pose2] = []
        self._work: deque[Iterator[None]] = deque()
        self._revisions = 0
        self._finished = 0  # keyframes that there were when there were no more scans

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Find the pose in the present stretch, and do a piece of what loops ask for."""
        estimate = self._located(displacement, scan)
        revised = self._work_on()
        self._numbers.append(len(self.places) - 1)
        self._locals.append(estimate.pose)
        frame = Pose2.of(self.graph.poses[-1])
        self.pose = frame @ estimate.pose
        return estimate._replace(
            pose=self.pose, covariance=self._in_world(estimate, frame), revised=revised
        )

    def finish(self) -> None:
        """No more scans come: do what was put off, and look for loops of the last stretch."""
        keyframes = sum(len(place.keyframes) for place in self.places)
        if keyframes > self._finished:
            self._work.append(self._close(len(self.places) - 1))
            self._finished = keyframes
        while self._work:
            self._do(self._work[0])
        if self.graph.outdated:
            deque(self._moved(self.graph.steps()), maxlen=0)
        self._whole = WholeMap(self.map_model)  # whatever was drawn on the way
        if self._locals:
            self.pose = Pose2.of(self.graph.poses[self._numbers[-1]]) @ self._locals[-1]

    def trajectory(self) -> Array:
        """(n, 3) the pose of every update so far, as believed now."""
        if not self._locals:
            return np.zeros((0, 3))
        return compose(self.graph.poses[self._numbers], np.array(self._locals))

    def map(self) -> OccupancyGrid:
        """The scans of all stretches, where they are believed now to have been taken."""
        return self._whole.map(self.places, self.graph.poses)

    @property
    def nbytes(self) -> int:
        """Bytes of all maps at hand: the present stretch's, those ready to match with, the whole
        one. The keyframes' scans come on top."""
        front = self._front.map_model.cells.tiles.nbytes if self._front is not None else 0
        return front + self._matcher.nbytes + self._whole.nbytes

    # -- the present stretch -------------------------------------------------------------------

    def _located(self, displacement: Pose2, scan: Scan) -> Estimate:
        """The pose in the present stretch; a new one begins where this is long enough."""
        if self._front is None:
            self.graph.poses = np.array([self.pose @ displacement])
            return self._begin(LocalMap((), scan))
        before = self._front.keyframe
        estimate = self._front.update(displacement, scan)
        if self._front.keyframe is before:
            return estimate
        place = self.places[-1]
        if place.length < self.stretch or len(place.keyframes) < MIN_KEYFRAMES:
            place.add(scan, estimate.pose)
            return estimate
        if isinstance(self._front.sensor_model, Endpoint):
            self._matcher.keep(place, self._front.sensor_model)
        self._append(estimate)
        self._work.append(self._close(len(self.places) - 1))
        return self._begin(place.following(scan, estimate.pose, self.seeds), estimate.score)

    def _begin(self, place: LocalMap, score: float = 0.0) -> Estimate:
        self._front = MaximumLikelihood(
            rng=self.rng, map_model=self.local(), sensor_model=self.sensor_model(),
            motion_model=self.motion_model, search=self.search,
        )  # fmt: skip
        self._front.remember(place, score)
        self.places.append(place)
        return self._front.keyframe

    def _append(self, estimate: Estimate) -> None:
        """One more frame in the graph, where the present stretch has led."""
        frame = Pose2.of(self.graph.poses[-1])
        turn = turned(-estimate.pose.theta)
        covariance = turn @ estimate.covariance @ turn.T + DRIFT
        last = len(self.graph.poses) - 1
        self.graph.add_pose(frame @ estimate.pose)
        information = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
        self.graph.edges.append(Edge(last, last + 1, estimate.pose, information))
        self._sure = turn @ self._carried(estimate) @ turn.T + DRIFT

    def _in_world(self, estimate: Estimate, frame: Pose2) -> Array:
        turn = turned(frame.theta)
        return turn @ self._carried(estimate) @ turn.T

    def _carried(self, estimate: Estimate) -> Array:
        """The covariance of a pose in the present frame, with the frame's own error."""
        lever = lever_jacobian(estimate.pose.x, estimate.pose.y)
        return lever @ self._sure @ lever.T + estimate.covariance

    # -- loops ---------------------------------------------------------------------------------

    def _work_on(self) -> bool:
        """A piece for every stretch that waits. Whether it revised."""
        before = self._revisions
        for _ in range(len(self._work)):
            if self._work:
                self._do(self._work[0])
        return self._revisions > before

    def _do(self, work: Iterator[None]) -> None:
        if next(work, DONE) is DONE:
            self._work.popleft()

    def _close(self, here: int) -> Iterator[None]:
        """Match stretch `here` with older ones; optimise the graph if any shows the same place."""
        graph, place = self.graph, self.places[here]
        self._middles[here:] = [place.middle()]
        panorama = place.panorama()
        covariances = chained(len(graph.poses), graph.edges, graph.trust(), here)
        closed = False
        for other in self._candidates(here, covariances):
            frame = Pose2.of(graph.poses[other])
            predicted = frame.between(Pose2.of(graph.poses[here]))
            lever = lever_jacobian(predicted.x, predicted.y)
            match = self._matcher.match(
                self.places[other], panorama, predicted, lever @ covariances[other] @ lever.T
            )
            if self.loops.accepts(match):
                graph.edges.append(Edge(other, here, match.pose, match.information, loop=True))
                closed = True
            yield
        if closed:
            yield from self._moved(graph.adjusting())

    def _candidates(self, here: int, covariances: Array) -> list[int]:
        """Older stretches that may show the same place, the likeliest first."""
        middles = compose(self.graph.poses[: here + 1], np.array(self._middles[: here + 1]))
        apart = np.hypot(*(middles[:, :2] - middles[-1, :2]).T)
        spread = np.sqrt(covariances[: here + 1, 0, 0] + covariances[: here + 1, 1, 1])
        share = apart / (MAX_MIDDLE_DISTANCE + self.loops.sigmas * spread)
        order = np.argsort(share[: max(here - 1, 0)], kind="stable")  # not the one just before
        return [int(k) for k in order[: self.candidates] if share[k] < 1.0]

    def _moved(self, steps: Iterator[Array]) -> Iterator[None]:
        """Take the steps, then their poses; those added meanwhile move with the last of them."""
        graph = self.graph
        found = graph.poses
        for poses in steps:
            found = poses
            yield
        moved = Pose2.of(found[-1]) @ Pose2.of(graph.poses[len(found) - 1]).inverse()
        graph.poses = np.vstack([found, compose(moved, graph.poses[len(found) :])])
        self._sure = chained(len(graph.poses), graph.edges, graph.trust(), 0)[-1]
        self._revisions += 1


DONE = object()
