"""Graph SLAM: rigid local maps, and a pose graph of their frames.

The scheme of Konolige et al. (2010) and Hess et al. (2016); here each local map is built by maximum
likelihood SLAM, and the global map may use any map model.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.algorithms.second_start import NO_POSES, SecondStart
from slam.geometry import Array, Pose2, between, compose, lever_jacobian, turned
from slam.graph.alignment import ALIGNED, Alignment
from slam.graph.chain import MIN_WEIGHT, chained
from slam.graph.covariance import MIN_INFORMATION, size
from slam.graph.echoes import Echoes, echoes_of
from slam.graph.edges import Edge
from slam.graph.local_map import Keyframe, LocalMap, Panorama
from slam.graph.loops import Loops, Matcher, innovation
from slam.graph.path import Path
from slam.graph.pose_graph import PoseGraph
from slam.graph.redundancy import Redundancy
from slam.graph.searched_map import SearchedMap
from slam.graph.whole_map import WholeMap
from slam.grid import OccupancyGrid
from slam.interface import Estimate, MapModel, MotionModel, Search, SensorModel
from slam.maps.static import Static
from slam.memory import give_back
from slam.motion.adaptive import AdaptiveOdometry
from slam.recovery.astray import Astray
from slam.recovery.old_ground import OldGround
from slam.recovery.old_local_maps import LocalGround, old_endpoint
from slam.recovery.places import Surroundings
from slam.recovery.watch import MISPLACED, Watch
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.sensor_models.endpoint import Endpoint
from slam.validation import positive_number, whole_number

MIN_KEYFRAMES = 12  # of a local map
MAX_KEYFRAMES = 400  # of a local map, where the robot stands or turns
SPARSE = 0.3  # m between keyframes that are far apart
SPARSE_SEEDS, MAX_SEEDS = 150, 150  # seeds there, by the distance in m; at most
MAX_MIDDLE_DISTANCE = (
    6.0  # m between the centres of two local maps, beyond which they are not matched
)
SAVED = np.diag([0.02, 0.02, math.radians(0.3)]) ** 2  # m^2, rad^2: error of a remembered pose
JOINED = np.diag([0.1, 0.1, math.radians(2.0)]) ** 2  # m^2, rad^2: error of the start among them
DRIFT = np.diag([0.03, 0.03, math.radians(0.5)]) ** 2  # m^2, rad^2: error of a local map that
# its estimated covariance does not include, where it is largest
MOST_DRIFTED = 3.0  # standard deviations: a robot that is farther off has not only drifted
# The edges are weighted, and loops searched for, by the largest errors, since where a place is hard
# to match they are as large; `Estimate.covariance` is of the errors on average.
LARGEST = 5.0  # covariance of the largest errors of a local map, by the estimated one
AVERAGE = 0.02  # share of the largest errors' covariance that errors have on average, before loops
PRIOR_LOOPS = 2  # number of loops that AVERAGE counts as


class GraphSlam:
    """Builds a sequence of local maps, closes loops between them, and optimises their pose graph.

    Each local map ("stretch") covers a stretch of the path and has its own frame, within which
    poses are not revised before `finish`. The nodes of the graph are these frames. Its edges are
    the pose of each local map in the one before, and loops: matches of a finished local map with
    older ones, in a search window given by the uncertainty along the most certain chain of edges.
    After a loop the graph is optimised with a robust kernel that switches off loops which
    contradict the rest.

    Of each place a few local maps are kept; those that more make redundant are forgotten, and their
    edges and the robot's poses in them given to others of the same place. So memory and time are
    bounded by the size of the place. What a forgotten one added to the global map stays there until
    it is drawn anew, by a loop or by `finish`.

    Each update but those that begin a local map does one unit of that work (a match, or a step of
    the optimisation), which bounds its time, but for searches of the whole map where the robot may
    be elsewhere; where several local maps wait, it does one unit for each. `finish` does what is
    left, and then aligns all keyframes with each other.

    map_model   makes the global map
    local       makes a local map: a few metres, in which little changes
    stretch     m of path in a local map
    seeds       keyframes that a local map begins with, the last ones before it; more where
                keyframes are farther apart than usual
    candidates  maximum number of older local maps that a finished one is matched with
    visits      number of other local maps of the same place that make one redundant
    alignment   of all keyframes at the end; None: their poses in the local maps stay
    watch       tells whether the robot is lost, and finds it again; None: nobody does
    again       maps the first metres again if the odometry is very wrong; None: they stay
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
        seeds: int = 40,
        candidates: int = 5,
        visits: int = 5,
        alignment: Alignment | None = ALIGNED,
        watch: Watch | None = None,
        again: SecondStart | None = None,
    ):
        positive_number("stretch", stretch)
        whole_number("seeds", seeds, 0)
        whole_number("candidates", candidates, 0)
        whole_number("visits", visits, 1)
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
        self.alignment = alignment
        self.watch = watch
        self.again = again
        self.pose = start
        self.graph = PoseGraph(np.array([start]))
        self.places: list[LocalMap] = []
        self._front: MaximumLikelihood | None = None
        self._frame_covariance = np.zeros((3, 3))  # of the current local map's frame, in that frame
        self._share, self._looped = AVERAGE, 0  # learned from so many loops
        self._middles: list[Pose2] = []  # centres of the finished local maps, each in its frame
        self._matcher = Matcher(self.loops)
        self._redundancy = Redundancy(visits)
        self._whole = WholeMap(map_model)
        self._searched: SearchedMap | None = None  # from the first search on
        self._old_ground, self._old_map = OldGround(), SearchedMap()
        self._doubted: list[Keyframe] = []  # keyframes that are not part of a local map yet
        self._lost_since = 0  # number of updates before the robot got lost
        self._path = Path()
        self._work: deque[Iterator[None]] = deque()
        self._revisions = 0
        self._finished: Scan | None = None  # the last keyframe's at the last call of `finish`

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Estimate the pose in the current local map, and do a unit of pending loop work."""
        if self.again is None:
            return self.advance(displacement, scan)
        return self.again.update(self, displacement, scan)

    def advance(self, displacement: Pose2, scan: Scan) -> Estimate:
        """One update."""
        begun = len(self.places)
        estimate = self._located(displacement, scan)
        revised = len(self.places) == begun and self._work_on()  # beginning one takes as long
        self._path.append(len(self.places) - 1, estimate.pose)
        frame = Pose2.of(self.graph.poses[-1])
        self.pose = frame @ estimate.pose
        return estimate._replace(
            pose=self.pose, covariance=self._in_world(estimate, frame), revised=revised
        )

    def remember(self, keyframes: Iterable[tuple[Scan, Pose2]]) -> None:
        """Add scans at known poses as local maps, before the first update: later ones close loops
        with them. Edges to the first of them hold them in place."""
        if self.again is not None:
            self.again.stop()
        for scan, pose in keyframes:
            within = Pose2.of(self.graph.poses[-1]).between(pose)
            if self.places and self._continues(self.places[-1], scan, within):
                self.places[-1].add(scan, within)
            else:
                self._remember(LocalMap((), scan, len(self.places)), pose)
        self._middles = [place.middle() for place in self.places]
        self._old_ground.begin(len(self.places))

    def place(self, pose: Pose2) -> None:
        """Set the robot's pose, before the first update."""
        if self.watch is not None:
            self.watch.placed()
        self.pose = pose

    def finish(self) -> None:
        """After the last scan: complete pending work, close loops of the last local map, and align
        the keyframes."""
        scan = self.places[-1].keyframes[-1].scan if self.places else None
        new = scan is not self._finished
        if new:
            self._work.append(self._close(self.places[-1]))
            self._finished = scan
        while self._work:
            self._do(self._work[0])
        if self.graph.outdated:
            deque(self._moved(self.graph.steps()), maxlen=0)
        self._whole, self._searched = WholeMap(self.map_model), None  # drop what was drawn so far
        self._old_map = SearchedMap()
        self._matcher.pack()
        if new and self.alignment is not None:
            self._align(self.alignment)
        if len(self._path):
            self.pose = self._path.last(self.graph.poses)

    def _align(self, alignment: Alignment) -> None:
        """Align all keyframes with each other; edges of the graph that are trusted now measure
        what this gives."""
        graph, places = self.graph, self.places
        within = [np.array([one.pose for one in place.keyframes]) for place in places]
        poses = np.concatenate([compose(*one) for one in zip(graph.poses, within, strict=True)])
        aligned = alignment(self._echoes(poses), poses)
        trusted = graph.trust() >= MIN_WEIGHT
        begin = 0
        for number, before in enumerate(within):
            own = aligned[begin : begin + len(before)]
            begin += len(before)
            graph.poses[number] = own[0]
            after = between(own[0], own)
            self._path.realign(number, before, after)
            places[number].realign(after)
        first, second = graph.poses[graph.edges.ends[trusted].T]
        graph.edges.measured[trusted] = between(first, second)
        self._middles = [place.middle() for place in places]

    def _echoes(self, poses: Array) -> Echoes:
        """What all keyframes saw; `poses` (n, 3) are theirs in the world."""
        whole = WholeMap(self.local)
        whole.update(self.places, self.graph.poses)
        scans = [one.scan for place in self.places for one in place.keyframes]
        echoes = echoes_of(scans, poses, whole.map_model)
        del whole
        give_back()
        return echoes

    def trajectory(self) -> Array:
        """(n, 3) the pose of every update so far, as believed now."""
        return self._path.poses(self.graph.poses)

    @property
    def first_poses(self) -> Array:
        """(n, 3) poses of the first n updates, if they were mapped again; else (0, 3)."""
        return NO_POSES if self.again is None else self.again.poses

    def map(self) -> OccupancyGrid:
        """The scans of all local maps, integrated at their current pose estimates."""
        return self._whole.map(self.places, self.graph.poses)

    def sample(self, points: Array) -> tuple[Array, np.ndarray]:
        """(n,) h of the cells that hold points (n, 2), m, and whether they were observed."""
        self._whole.update(self.places, self.graph.poses)
        return self._whole.map_model.cells.sample(points)

    @property
    def nbytes(self) -> int:
        """Bytes of the maps in memory: the current local map, those cached for matching, the
        global map, and those that are searched for a lost robot. The scans of the keyframes are
        not counted."""
        front = self._front.map_model.cells.tiles.nbytes if self._front is not None else 0
        searched = self._searched.nbytes if self._searched is not None else 0
        searched += self._old_map.nbytes
        return front + self._matcher.nbytes + self._whole.nbytes + searched

    # -- the current local map -----------------------------------------------------------------

    def _located(self, displacement: Pose2, scan: Scan) -> Estimate:
        """The pose in the current local map; starts a new one when this one is long enough."""
        if self._front is None:
            self._join(self.pose @ displacement)
            return self._begin(LocalMap((), scan, len(self.places)))
        before, astray = self._front.keyframe, self._front.astray
        estimate = self._front.update(displacement, scan)
        if astray is not None:
            return estimate if self._front.astray is not None else self._rejoined(astray, estimate)
        if self._front.keyframe is before:
            return estimate
        if self._front.astray is not None:
            self._lost_since = len(self._path)
            self._doubted.clear()
            return estimate
        self._doubted.append(Keyframe(scan, estimate.pose))
        if self.watch is None or not self.watch.withheld:
            return self._kept(estimate)
        return estimate

    def _kept(self, estimate: Estimate) -> Estimate:
        """Add the new keyframes to the current local map, or the last one to the next."""
        assert self._front is not None
        place, last = self.places[-1], self._doubted[-1]
        full = self._complete(place)
        for scan, pose in self._doubted[:-1] if full else self._doubted:
            place.add(scan, pose)
        self._doubted.clear()
        if not full:
            return estimate
        if isinstance(self._front.sensor_model, Endpoint):
            self._matcher.keep(place, self._front.sensor_model)
        self._work.append(self._close(place))
        self._append(estimate)
        begun = self._begin(
            place.following(last.scan, last.pose, self._seeds(place)), estimate.score
        )
        return begun._replace(lost=estimate.lost)

    def _surroundings(self) -> Surroundings:
        """The map that a lost robot is searched for in, and the current local map in it: the whole
        one, or without the last local maps if these are misplaced; at the poses of the graph, as a
        place far away does not move with the nearest local map."""
        poses = self.graph.poses
        if self._old_ground.votes >= MISPLACED:
            old = old_endpoint(self._old_map, self.places, poses)
            return Surroundings(old, Pose2.of(poses[-1]))
        if self._searched is None:
            self._searched = SearchedMap()
        return Surroundings(self._searched.endpoint(self.places, poses), Pose2.of(poses[-1]))

    def _rejoined(self, astray: Astray, found: Estimate) -> Estimate:
        """A local map of what was mapped apart, tied to the graph where the robot was found. If the
        robot had only drifted, this closes a loop; if not, no edge leads to it from the local map
        in which the robot got lost."""
        assert self._front is not None
        self._work.append(self._close(self.places[-1]))
        first = astray.keyframes[0]
        place = LocalMap((), first.scan, self.places[-1].ordinal + 1)
        for scan, pose in astray.keyframes[1:]:
            place.add(scan, first.pose.between(pose))
        here = first.pose.between(astray.pose)
        origin = Pose2.of(self.graph.poses[-1]) @ self._front.pose @ here.inverse()
        believed = astray.believed @ first.pose
        drifted = self._drifted_from(believed, origin) if astray.drifted else None
        self._join(origin, JOINED if astray.sure else astray.covariance, drifted)
        if drifted is not None:
            self._close_way(believed)
        self._path.rebase(self._lost_since, len(self.places), believed)
        score = self._front.keyframe.score
        estimate = self._begin(place, score)
        self._old_ground.begin(place.ordinal)
        assert self._front is not None
        self._front.place(here)
        return estimate._replace(pose=here, lost=found.lost)

    def _begin(self, place: LocalMap, score: float = 0.0) -> Estimate:
        self._front = MaximumLikelihood(
            rng=self.rng, map_model=self.local(), sensor_model=self.sensor_model(),
            motion_model=self.motion_model, search=self.search, watch=self.watch,
            surroundings=self._surroundings,
        )  # fmt: skip
        self._front.remember(place, score)
        self.places.append(place)
        return self._front.keyframe

    def _seeds(self, place: LocalMap) -> int:
        """The number of seeds of the local map after `place`: more where scans are far apart, and
        each shows what few others do."""
        spacing = _spacing(place)
        if spacing < SPARSE:
            return self.seeds
        return min(max(round(SPARSE_SEEDS * spacing), self.seeds), max(self.seeds, MAX_SEEDS))

    def _complete(self, place: LocalMap) -> bool:
        long = place.length >= self.stretch and len(place.keyframes) >= MIN_KEYFRAMES
        return long or len(place.keyframes) >= MAX_KEYFRAMES

    def _continues(self, place: LocalMap, scan: Scan, pose: Pose2) -> bool:
        """Whether a remembered scan belongs to the local map: it is of the same recording."""
        last = place.keyframes[-1]
        near = math.dist(last.pose[:2], pose[:2]) <= self.stretch
        return near and scan.time >= last.scan.time and not self._complete(place)

    def _remember(self, place: LocalMap, pose: Pose2) -> None:
        """Add a local map whose frame is known to be at `pose`."""
        if self.places:
            self._tie(0, pose, SAVED)
        else:
            self.graph.poses = np.array([pose])
        self.places.append(place)

    def _drifted_from(self, believed: Pose2, found: Pose2) -> int | None:
        """The number of the nearest local map to where the robot was found from which errors on the
        way to there may have added up to what it was off; None if there is no such one.

        believed, found  of a frame: in the last frame, and in the world
        """
        graph, last = self.graph, len(self.graph.poses) - 1
        covariances = chained(len(graph.poses), graph.edges, graph.trust(), last)
        seemed = Pose2.of(graph.poses[last]) @ believed
        information = np.asarray(np.linalg.inv(JOINED), dtype=np.float64)
        for number in self._by_distance(found):
            there = Pose2.of(graph.poses[number]).between(found)
            seen = self._seen_from(number, seemed, covariances)
            if innovation(there, information, *seen) <= MOST_DRIFTED:
                return number
        return None

    def _seen_from(self, number: int, pose: Pose2, covariances: Array) -> tuple[Pose2, Array]:
        """A pose of the graph in frame `number`, and its (3, 3) covariance there; `covariances`
        (n, 3, 3) are those of all frames relative to the pose's, see `chained`."""
        seen = Pose2.of(self.graph.poses[number]).between(pose)
        lever = lever_jacobian(seen.x, seen.y)
        return seen, lever @ covariances[number] @ lever.T

    def _close_way(self, believed: Pose2) -> None:
        """Add the way from the last local map but one to the last frame, which is tied to the graph
        elsewhere, and let the graph close the loop."""
        last = len(self.graph.poses) - 1
        information = np.asarray(np.linalg.inv(JOINED), dtype=np.float64)
        self.graph.edges.append(Edge(last - 1, last, believed, information, loop=True))
        self._work.append(self._moved(self.graph.steps()))

    def _by_distance(self, pose: Pose2) -> list[int]:
        """The numbers of the frames, the nearest first."""
        apart = np.hypot(*(self.graph.poses[:, :2] - pose[:2]).T)
        return [int(number) for number in np.argsort(apart, kind="stable")]

    def _join(self, pose: Pose2, covariance: Array = JOINED, tied: int | None = None) -> None:
        """Add a frame at a pose in the graph, known with (3, 3) `covariance` relative to frame
        number `tied`, or to the nearest one: of this recording's first local map, or of a robot
        that was found again."""
        if not self.places:
            self.graph.poses = np.array([pose])
            return
        self._tie(self._by_distance(pose)[0] if tied is None else tied, pose, covariance)
        self._frame_covariance = self._chained_to_last()

    def _chained_to_last(self) -> Array:
        """The covariance of the last frame along the chain of edges, in that frame."""
        graph = self.graph
        largest = np.linalg.inv(graph.edges.information + np.diag(MIN_INFORMATION))
        average = graph.edges.given + self._share * largest
        information = np.asarray(np.linalg.inv(average), dtype=np.float64)
        return chained(len(graph.poses), graph.edges, graph.trust(), 0, information)[-1]

    def _tie(self, number: int, pose: Pose2, covariance: Array) -> None:
        """Add a pose to the graph, known relative to another with a (3, 3) covariance."""
        information = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
        displacement = Pose2.of(self.graph.poses[number]).between(pose)
        new = self.graph.add_pose(pose)
        self.graph.edges.append(Edge(number, new, displacement, information, given=covariance))

    def _append(self, estimate: Estimate) -> None:
        """Add the frame of the next local map to the graph, at the current estimate."""
        frame = Pose2.of(self.graph.poses[-1])
        turn = turned(-estimate.pose.theta)
        largest = LARGEST * turn @ estimate.covariance @ turn.T + DRIFT
        last = len(self.graph.poses) - 1
        self.graph.add_pose(frame @ estimate.pose)
        information = np.asarray(np.linalg.inv(largest), dtype=np.float64)
        self.graph.edges.append(Edge(last, last + 1, estimate.pose, information))
        carried = turn @ self._carried(estimate.pose) @ turn.T
        self._frame_covariance = carried + self._share * largest

    def _in_world(self, estimate: Estimate, frame: Pose2) -> Array:
        turn = turned(frame.theta)
        return turn @ (self._carried(estimate.pose) + estimate.covariance) @ turn.T

    def _carried(self, pose: Pose2) -> Array:
        """The covariance of a pose in the current frame by the error of the frame."""
        lever = lever_jacobian(pose.x, pose.y)
        return lever @ self._frame_covariance @ lever.T

    # -- loops ---------------------------------------------------------------------------------

    def _work_on(self) -> bool:
        """Do one unit of work for each pending local map; returns whether poses were revised."""
        before = self._revisions
        for _ in range(len(self._work)):
            if self._work:
                self._do(self._work[0])
        return self._revisions > before

    def _do(self, work: Iterator[None]) -> None:
        if next(work, NO_WORK_LEFT) is NO_WORK_LEFT:
            self._work.popleft()

    def _close(self, place: LocalMap) -> Iterator[None]:
        """Match a local map with older ones; optimise the graph if a loop is accepted; then forget
        what it makes redundant."""
        graph, here = self.graph, self.places.index(place)
        self._middles[here:] = [place.middle()]
        panorama = place.panorama()
        covariances = chained(len(graph.poses), graph.edges, graph.trust(), here)
        closed = False
        for other in self._candidates(here, covariances):
            seen = self._seen_from(other, Pose2.of(graph.poses[here]), covariances)
            match = self._matcher.match(self.places[other], panorama, *seen)
            if self.loops.accepts(match):
                loop = Edge(other, here, match.pose, match.information, loop=True)
                graph.edges.append(loop)
                self._learn(match.innovation)
                closed = True
            yield
        if closed:
            yield from self._moved(graph.adjusting())
        if place is not self.places[-1]:
            if self.watch is not None and self._is_sure():
                self._judge(self.watch, self.places.index(place), panorama)
                yield
            self._matcher.build(place)
            place.compact()
        while self._forget(self.places.index(place)):
            yield

    def _judge(self, watch: Watch, here: int, scan: Panorama) -> None:
        """Judge whether a local map, the panorama of which is `scan`, is where it seems to be."""
        now = slice(here + 1)
        ground = LocalGround(
            self.places[now], self.graph.poses[now], self._middles[now], self._matcher,
            self._old_map,
        )  # fmt: skip
        self._old_ground.judge(ground, scan)
        watch.suspected, watch.arriving = self._old_ground.votes, self._old_ground.arriving

    def _is_sure(self) -> bool:
        """Whether the robot does not map apart."""
        return self._front is not None and self._front.astray is None

    def _forget(self, here: int) -> bool:
        """Forget a local map near number `here`, if one is redundant; returns whether it did."""
        graph = self.graph
        middles = compose(graph.poses[: here + 1], np.array(self._middles[: here + 1]))
        chosen = self._redundancy.choice(self.places, middles[:, :2], graph.poses, here)
        if chosen is None:
            return False
        number, others = chosen
        covariances = chained(len(graph.poses), graph.edges, graph.trust(), number)
        into = min(others.tolist(), key=lambda k: size(covariances[k]))
        frames = Pose2.of(graph.poses[into]), Pose2.of(graph.poses[number])
        graph.forget(number, into)
        self._path.forget(number, into, frames[0].between(frames[1]))
        self._matcher.forget(self.places.pop(number))
        del self._middles[number]
        for whole in (self._whole, self._searched, self._old_map):
            if whole is not None:
                whole.forget(number)
        return True

    def _learn(self, innovation: float) -> None:
        """Learn from a loop how large errors are, by the largest: its innovation."""
        self._looped += 1
        square = min(innovation**2 / 3.0, 1.0)
        self._share += (square - self._share) / (PRIOR_LOOPS + self._looped)

    def _candidates(self, here: int, covariances: Array) -> list[int]:
        """Indices of older local maps that may show the same place, the likeliest first."""
        middles = compose(self.graph.poses[: here + 1], np.array(self._middles[: here + 1]))
        apart = np.hypot(*(middles[:, :2] - middles[-1, :2]).T)
        spread = np.sqrt(covariances[: here + 1, 0, 0] + covariances[: here + 1, 1, 1])
        share = apart / (MAX_MIDDLE_DISTANCE + self.loops.sigmas * spread)
        order = np.argsort(share[: max(here - 1, 0)], kind="stable")  # not the one just before
        return [int(k) for k in order[: self.candidates] if share[k] < 1.0]

    def _moved(self, steps: Iterator[Array]) -> Iterator[None]:
        """Run the optimisation, then use its poses; later frames move rigidly with the last."""
        graph = self.graph
        found = graph.poses
        for poses in steps:
            found = poses
            yield
        moved = Pose2.of(found[-1]) @ Pose2.of(graph.poses[len(found) - 1]).inverse()
        graph.poses = np.vstack([found, compose(moved, graph.poses[len(found) :])])
        self._frame_covariance = self._chained_to_last()
        self._revisions += 1


def _spacing(place: LocalMap) -> float:
    """m between the keyframes of a local map."""
    return place.length / max(len(place.keyframes) - 1, 1)


NO_WORK_LEFT = object()
