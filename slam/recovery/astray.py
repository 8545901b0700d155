"""The lost robot: it draws a map of its own, which is searched for in the map that it had."""

from __future__ import annotations

import math
from functools import partial
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, near
from slam.graph.local_map import Keyframe, panorama
from slam.interface import Estimate, Slam
from slam.motion.threshold import KEYFRAMES, MotionThreshold, MotionTrigger
from slam.recovery.demands import NEW_GROUND, SUDDEN, Demands
from slam.recovery.places import (
    CAREFUL,
    MANY,
    Place,
    Places,
    Surroundings,
    agree,
    same_place,
)
from slam.scan import Scan

ATTEMPTS = MotionThreshold(distance=0.5, turn=math.radians(45.0), time=2.0)
MAX_RECENT = 100  # keyframes that are matched: in a corridor 10 m tell more than 4
LEAST_EXPLAINED = 0.55  # of the usual share, at a place that is accepted if nothing contradicts it
WELL_EXPLAINED = 0.78  # the same, if as much contradicts it as the demands allow
LESS_EXPLAINED = 0.1  # share of the echoes, at most, of a place that fits nearly as well
MIN_GAIN = 15.0  # nats, of the best place over the second best
LOST_COVARIANCE = np.diag([5.0, 5.0, 1.0]) ** 2  # m^2, rad^2
FOUND_COVARIANCE = np.diag([0.05, 0.05, 0.02]) ** 2  # the same, of one that was found again,
UNSURE_COVARIANCE = np.diag([0.5, 0.5, 0.07]) ** 2  # or that goes on on new ground
CONFIRMED = 2  # attempts in a row that find a sure place, before the robot is believed to be there
LEAD, REPEATED = 3.0, 5  # nats over the second best place, and attempts, of one that is less sure
SOME_WAY = 6.0  # m, driven before that
DRIFTED, DRIFT = 10.0, (1.5, math.radians(20.0))  # nats of a place so near to the believed one,
# if it was not carried
FIRST = 8.0  # m of the way on new ground, of which the map may know more:
LITTLE_KNOWN = 0.5  # share of the echoes that the map knows there, at most
LONGER = 20  # attempts, where the believed place may be right: new ground may look like another
CONTRADICTED = 0.1  # place, and so may a corner where a loop closes: it contradicts so few echoes
LASTING = 16  # attempts in a row whose best place is the same: the map has changed there;
HALF = 0.5  # of the usual share is explained there, at least (see also `Astray._disputed`)
CLEARLY_BETTER = 40.0  # nats over the believed place, of another one, or it explains
NEARLY_ALL = 0.88  # of the usual share, at least
SEEN = 5  # attempts in a row that find a place, by NEARLY_ALL: where it goes on off the map's end
TIE = 5.0  # nats by which the best place must exceed the believed one, if it is not the same


class Attempt(NamedTuple):
    """What an attempt finds.

    place  that is acceptable; None: none is
    times  attempts in a row that must find it
    """

    place: Place | None
    times: int = CONFIRMED


class Repeated:
    """A pose that attempts in a row find.

    pose   by the last attempt; None: it found none
    times  attempts in a row that found it
    """

    def __init__(self) -> None:
        self.pose: Pose2 | None = None
        self.times = 0

    def take(self, pose: Pose2 | None) -> None:
        """Take in what the next attempt found."""
        before, self.pose = self.pose, pose
        same = pose is not None and before is not None and agree(before, pose)
        self.times = self.times + 1 if same else int(pose is not None)


class Astray:
    """Maps apart while the robot is lost; nothing is drawn into the map until it is found there.

    The last metres of its path, as one scan, are searched for in the whole map. A place is accepted
    if the map agrees with them as the demands ask, and explains NEARLY_ALL or is CLEARLY_BETTER
    than the believed one, and if CONFIRMED attempts in a row find it; REPEATED ones, if another
    place fits nearly as well, and none with less than LEAD; LONGER ones, while the believed place
    may be right, or where a loop closes, for a place that is not likely. Where the map has changed,
    less is asked of a place that is the best in LASTING attempts in a row. In a building whose
    corridors look alike that takes long: until then the robot says that it is lost. If none is
    found, and the believed place is new ground that the robot came to through no wall, a scan was
    misjudged, and it goes on there; or where it left the map, if that explained NEARLY_ALL of it in
    SEEN attempts in a row before.

    believed   pose of the origin of its own map when it got lost, in the SLAM's frame
    keyframes  of its own map, in its frame
    pose       of the robot, in its frame
    sure       whether it was found at a place of the map, and does not only go on on new ground
    """

    def __init__(
        self,
        front: Slam,
        surroundings: Surroundings,
        believed: Pose2,
        lost: float,
        demands: Demands = SUDDEN,
    ):
        """Start at the `believed` pose, which is wrong with probability `lost`, and search in the
        `surroundings`; `front` maps from the origin.

        demands  of a place other than the believed one
        """
        self._demands, self._path = demands, 0.0
        self.sure = False
        self.believed, self.pose = believed, Pose2()
        self._front, self._frame, self._lost = front, surroundings.frame, lost
        self._places = Places(surroundings.endpoint, known=True, echoes=MANY, rating=CAREFUL)
        self.keyframes: list[Keyframe] = []
        self._since_keyframe = MotionTrigger(KEYFRAMES)
        self._since_attempt = MotionTrigger(ATTEMPTS)
        self._found = Repeated()  # origins that are acceptable
        self._best = Repeated()  # origins by places that lead, where the believed one is disputed
        self._well = Repeated()  # origins that are acceptable, and explain NEARLY_ALL
        self._goes_on: Pose2 | None = None  # the origin where it left the map; None: it did not
        self._new_ground = demands.new_ground  # m, of the path, after which it goes on
        self._no_new_ground = demands.no_new_ground  # at the believed place

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """The pose by the map apart, at the place that was believed when the robot got lost."""
        estimate = self._front.update(displacement, scan)
        self.pose = estimate.pose
        self._path += math.hypot(displacement.x, displacement.y)
        for trigger in (self._since_keyframe, self._since_attempt):
            trigger.move(displacement)
        if self._since_keyframe.due(scan.time):
            self._since_keyframe.restart(scan.time)
            self.keyframes.append(Keyframe(scan, estimate.pose))
        return estimate._replace(
            pose=self.believed @ estimate.pose,
            covariance=estimate.covariance + LOST_COVARIANCE,
            lost=self._lost,
        )

    @property
    def covariance(self) -> Array:
        """(3, 3) of the pose, once it was found."""
        return FOUND_COVARIANCE if self.sure else UNSURE_COVARIANCE

    @property
    def drifted(self) -> bool:
        """Whether it was found, and no scan tells that it was carried: its errors may have added
        up."""
        return self.sure and self._demands.continuous

    def found(self, time: float) -> Pose2 | None:
        """The pose in the SLAM's frame of the origin of the map apart, if it is found at `time`."""
        if not self._since_attempt.due(time):
            return None
        self._since_attempt.restart(time)
        last = self.keyframes[-1].pose
        recent = self.keyframes[-MAX_RECENT:]
        scan = panorama([one.seen_from(last) for one in recent])
        believed = self._frame @ self.believed @ last
        place, times = self._attempt(scan, believed)
        origin = None if place is None else self._origin(place)
        self._found.take(origin)
        well = place is not None and self._nearly_all(place) and self._likely(place, believed)
        self._well.take(origin if well else None)
        if self._well.times >= SEEN:
            self._goes_on, self._new_ground = self._well.pose, self._path + NEW_GROUND
        self.sure = self._found.times >= times
        if self.sure:
            return origin
        self.sure = self._no_new_ground and self._best.times >= LASTING
        if self.sure:
            return self._best.pose
        far = origin is None and self._path > self._new_ground
        return (self._goes_on or self.believed) if far and self._may_go_on(scan) else None

    def _may_go_on(self, scan: Scan) -> bool:
        """Whether the ground may be new where the robot would go on."""
        if self._goes_on is None:
            return not self._no_new_ground
        start = self._frame @ self._goes_on @ self.keyframes[-1].pose
        return self._may_be_new(self._places.matched(scan, start), self._goes_on)

    def _origin(self, place: Place) -> Pose2:
        """That of the map apart in the SLAM's frame, if the last keyframe was taken at a place."""
        return self._frame.inverse() @ place.pose @ self.keyframes[-1].pose.inverse()

    def _attempt(self, scan: Scan, believed: Pose2) -> Attempt:
        """Find the place of the scan: the best one, if it meets the demands; or the believed one,
        if none is better and, after a sign that the robot was carried, the map agrees there."""
        found = self._places.all(scan, LEAST_EXPLAINED * self._demands.usual)
        here = self._places.matched(scan, believed)
        new = self._may_be_new(here, self.believed)
        self._no_new_ground = self._no_new_ground or not new
        best = max(found, key=partial(self._worth, believed=believed), default=here)
        lead = self._lead(best, [*found, here], believed)
        near_here = any(same_place(best.pose, pose) for pose in (believed, here.pose))
        clear = near_here or best.value > here.value + CLEARLY_BETTER
        shown = best.agreement.explained > HALF * self._demands.usual
        disputed = near_here or self._disputed(here)
        unlikely = not self._likely(best, believed)
        lasting = bool(found) and disputed and shown and lead > LEAD and not unlikely
        self._best.take(self._origin(best) if lasting else None)
        right_here = not self._demands.sudden or self._meets(here)
        if not found or not self._possible(best, believed):
            return Attempt(here if right_here else None)
        if not (near_here or self._meets(best)):
            tied = best.value - here.value < TIE
            return Attempt(here if right_here and tied else None)
        well = near_here or self._nearly_all(best)
        least = LEAD if well and self._path > SOME_WAY else MIN_GAIN
        if lead <= least or not (clear or well):
            return Attempt(None)
        return Attempt(best, LONGER if unlikely else self._times(lead, clear, here))

    def _worth(self, place: Place, believed: Pose2) -> float:
        """The value of a place with its prior: where each scan followed from the one before, errors
        add up more often than a robot is carried."""
        drifted = self._demands.continuous and near(place.pose, believed, *DRIFT)
        return place.value + DRIFTED * drifted

    def _lead(self, best: Place, found: list[Place], believed: Pose2) -> float:
        """Nats by which the best place is worth more than any other one that explains about as
        much."""
        least = best.agreement.explained - LESS_EXPLAINED
        others = [self._worth(place, believed) for place in found
                  if place.agreement.explained > least
                  and not same_place(place.pose, best.pose)]  # fmt: skip
        return self._worth(best, believed) - max(others, default=-math.inf)

    def _likely(self, place: Place, believed: Pose2) -> bool:
        """Whether a place is as near to the believed one as errors lead where a loop closes."""
        return math.dist(place.pose[:2], believed[:2]) <= self._demands.likely

    def _may_be_new(self, here: Place, origin: Pose2) -> bool:
        """Whether the robot may be driving on ground that the map does not know, if it is `here`,
        and its own map at an origin."""
        if self._path > FIRST and sum(here.agreement) > LITTLE_KNOWN:
            return False
        path = np.array([self._frame @ origin @ one.pose for one in self.keyframes])
        return not self._places.crossed(path[:, :2])

    def _times(self, lead: float, clear: bool, here: Place) -> int:
        """How many attempts in a row must find a place that leads by so many nats, and that is
        clearly better than the believed one or not."""
        clear = clear and lead > MIN_GAIN
        right = here.agreement.contradicted <= CONTRADICTED and not self._demands.torn
        if not self._no_new_ground and (right or not clear):
            return LONGER
        return CONFIRMED if lead > MIN_GAIN else REPEATED

    def _disputed(self, place: Place) -> bool:
        """Whether the map explains little of the scan at a place, or contradicts it."""
        explained, contradicted = place.agreement
        return explained < HALF * self._demands.usual or contradicted > CONTRADICTED

    def _nearly_all(self, place: Place) -> bool:
        """Whether the map explains nearly as much at a place as usual."""
        return place.agreement.explained > NEARLY_ALL * self._demands.usual

    def _possible(self, place: Place, believed: Pose2) -> bool:
        """Whether a place is as near to the believed one as the demands ask."""
        within = self._demands.within
        return within is None or near(place.pose, believed, *within)

    def _meets(self, place: Place) -> bool:
        """Whether a place meets the demands."""
        if self._path < self._demands.path:
            return False
        explained, contradicted = place.agreement
        share = explained / self._demands.usual - LEAST_EXPLAINED
        share /= WELL_EXPLAINED - LEAST_EXPLAINED
        return share >= 0.0 and contradicted <= min(share, 1.0) * self._demands.contradicted
