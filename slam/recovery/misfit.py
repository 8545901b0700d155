"""Scans that agree with the map less than usual, metre after metre: of a robot that is not where it
believes to be, in a place that looks much the same there."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from slam.geometry import Pose2
from slam.graph.local_map import Keyframe, panorama
from slam.recovery.match import Match
from slam.recovery.places import MANY, Place, Places, Surroundings, agree, best_near, matched, near
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

WINDOW = 10  # keyframes, whose mean shares count
MEMORY, LEAST_LEARNED = 150, 30  # keyframes that the usual ones are the mean of; first ones
LESS_EXPLAINED, MORE_WRONG = 0.06, 0.05  # than usual, of shares that are not,
DEVIATIONS = 2.0  # and by so many usual deviations
KNOWN = (
    0.9  # usual share of explained echoes, at least, of a robot on known ground: new ground that
)
# looks like another place is none to be searched for
KEPT = 40  # keyframes that are searched for together
PAUSE, LONGEST_PAUSE = 5, 320  # keyframes between two searches; doubled by each that finds nothing
WITHHELD = 60  # keyframes, at most, that are not drawn while another place is suspected
HELD = 100  # keyframes, after which unusual shares become usual
AS_USUAL = 0.05  # share of the echoes by which another place may agree less than usual
NEARBY = 1.0, 1.0, math.radians(10.0)  # m, m, rad: drift of a map that is drawn twice
MOVED = 0.1, math.radians(1.5)  # m, rad, at least, of such a drift
GAIN_NEAR, GAIN = 10.0, 15.0  # nats by which they fit better there, or at another place
VOTES = 3  # searches in a row that find the same other place


class Found(NamedTuple):
    """What a search found.

    anchor     pose near that of the match at which the last keyframes fit as usual, or None
    elsewhere  whether they did so at another place of the map, VOTES times in a row
    """

    anchor: Pose2 | None
    elsewhere: bool


class Misfit:
    """Watches what share of the last keyframes the map explains, and what share it knows and does
    not explain; searches for where they fit, if these are unusual.

    A door that moves takes a few beams for a while. A robot at the wrong place of a building whose
    corridors look alike finds each door frame elsewhere than the map has it, and where a map is
    drawn a second time beside itself, as a loop closes, it explains half of each scan.

    votes  searches in a row that found the same other place
    """

    def __init__(self) -> None:
        self._steps: deque[Keyframe] = deque(maxlen=KEPT)  # each from the one before
        self._shares: deque[tuple[float, float]] = deque(maxlen=WINDOW)
        self._usual, self._spread = [0.0, 0.0], [0.0, 0.0]
        self._learned = 0
        self.clear()

    def clear(self) -> None:
        """The next keyframe is taken elsewhere."""
        self._steps.clear()
        self._shares.clear()
        self.votes, self._way = 0, Pose2()
        self._count = 0  # keyframes in a row for which the mean is unusual
        self._since, self._pause = PAUSE, PAUSE  # keyframes since the last search; until the next

    def add(self, match: Match) -> None:
        """Add a keyframe at the pose of its match."""
        if not match.continuous:
            self.clear()
        pose = match.estimate.pose
        self._steps.append(Keyframe(match.scan, match.last.between(pose)))
        self.take(match.endpoint.known_shares(match.scan.pieces, pose))

    def take(self, shares: tuple[float, float]) -> None:
        """Take in what share of a keyframe the map explains, and what it knows but does not."""
        self._shares.append(shares)
        self._since += 1
        if len(self._shares) < WINDOW:
            return
        mean = [sum(each) / WINDOW for each in zip(*self._shares, strict=True)]
        unusual = self._learned >= LEAST_LEARNED and self._is_unusual(*mean)
        self._count = self._count + 1 if unusual else 0
        if not self._count:
            self.votes = 0
            self._pause = PAUSE if self._since > self._pause else self._pause
        if not unusual or self._count > HELD:
            self._learn(mean)

    def _is_unusual(self, explained: float, wrong: float) -> bool:
        less = max(LESS_EXPLAINED, DEVIATIONS * self._spread[0])
        more = max(MORE_WRONG, DEVIATIONS * self._spread[1])
        return explained < self._usual[0] - less and wrong > self._usual[1] + more

    def _learn(self, mean: list[float]) -> None:
        self._learned = min(self._learned + 1, MEMORY)
        rate = 1.0 / self._learned
        for k, share in enumerate(mean):
            self._spread[k] += rate * (abs(share - self._usual[k]) - self._spread[k])
            self._usual[k] += rate * (share - self._usual[k])

    @property
    def withholds(self) -> bool:
        """Whether the last keyframes are not to be drawn yet."""
        return self.votes > 0 and self._count <= WITHHELD

    @property
    def due(self) -> bool:
        """Whether the keyframes are to be searched for now."""
        return self._count > 0 and self._since >= self._pause

    def search(self, match: Match, surroundings: Callable[[], Surroundings]) -> Found:
        """Where the last keyframes fit, the last one being that of the match."""
        scan, pose, endpoint = panorama(self._seen_from_last()), match.estimate.pose, match.endpoint
        self._since = 0
        close = matched(endpoint, scan, best_near(endpoint, scan, pose, NEARBY))
        if self._fits(endpoint, scan, close, pose, GAIN_NEAR):
            self._pause, self.votes, self._count = PAUSE, 0, 0
            self._shares.clear()
            return Found(None if near(close.pose, pose, *MOVED) else close.pose, elsewhere=False)
        way = self._way_elsewhere(scan, pose, surroundings()) if self._usual[0] > KNOWN else None
        if way is None:
            self._pause, self.votes = min(2 * self._pause, LONGEST_PAUSE), 0
            return Found(None, elsewhere=False)
        same = self.votes > 0 and agree(self._way @ pose, way @ pose)
        self._way, self._pause, self.votes = way, PAUSE, self.votes + 1 if same else 1
        return Found(None, elsewhere=self.votes >= VOTES)

    def _way_elsewhere(self, scan: Scan, pose: Pose2, surroundings: Surroundings) -> Pose2 | None:
        """From here to another place of the whole map at which the last keyframes fit."""
        endpoint, here = surroundings.endpoint, surroundings.frame @ pose
        places = Places(endpoint, known=True, echoes=MANY, rated=True)
        other = places.best(scan, self._usual[0] - AS_USUAL)
        if other is None or not self._fits(endpoint, scan, other, here, GAIN):
            return None
        return surroundings.frame.inverse() @ other.pose @ pose.inverse()

    def _fits(self, endpoint: Endpoint, scan: Scan, place: Place, pose: Pose2, gain: float) -> bool:
        """Whether a map agrees with keyframes as usual at a place, and better than at a pose."""
        explained, wrong = endpoint.known_shares(scan.points, place.pose)
        usual = explained > self._usual[0] - AS_USUAL and wrong < self._usual[1] + AS_USUAL
        return usual and place.value > matched(endpoint, scan, pose).value + gain

    def _seen_from_last(self) -> list[Keyframe]:
        """The keyframes in the frame of the last one."""
        found, pose = [], Pose2()
        for scan, step in reversed(self._steps):
            found.append(Keyframe(scan, pose))
            pose = pose @ step.inverse()
        return found[::-1]
