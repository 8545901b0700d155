"""Scans that agree with the map less than usual, metre after metre: of a robot that is not where it
believes to be, in a place that looks much the same there."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.graph.local_map import Keyframe, panorama
from slam.recovery.match import Match
from slam.recovery.places import Place, Places, Surroundings, agree, best_near, matched, near
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

WINDOW = 10  # keyframes, whose mean shares count
MEMORY, LEAST_LEARNED = 150, 30  # keyframes that the usual ones are the mean of; first ones
LESS_EXPLAINED, MORE_WRONG = 0.06, 0.05  # than usual, of shares that are not,
DEVIATIONS = 3.0  # and by so many usual deviations
KNOWN = (
    0.9  # usual share of explained echoes, at least, of a robot on known ground: new ground that
)
# looks like another place is none to be searched for
KEPT = 40  # keyframes that are searched for together,
ECHOES = 150  # and their echoes in the coarse map
PAUSE, LONGEST_PAUSE = 5, 320  # keyframes between two searches; doubled by each that finds nothing
HELD = 100  # keyframes, after which unusual shares become usual
AS_USUAL = 0.05  # share of the echoes by which another place may agree less than usual
NEARBY = 1.0, 1.0, math.radians(10.0)  # m, m, rad: drift of a map that is drawn twice
MOVED = 0.1, math.radians(1.5)  # m, rad, at least, of such a drift
GAIN_NEAR, GAIN = 10.0, 15.0  # nats by which they fit better there, or at another place
VOTES = 3  # searches in a row that find the same other place


class Found(NamedTuple):
    """What a search found.

    anchor     pose near the believed one at which the last keyframes fit as usual, or None
    elsewhere  whether they did so at another place of the map, VOTES times in a row
    """

    anchor: Pose2 | None = None
    elsewhere: bool = False


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
        self._usual, self._spread = np.zeros(2), np.zeros(2)
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
        mean = np.mean(self._shares, axis=0)
        unusual = self._learned >= LEAST_LEARNED and self._is_unusual(*mean.tolist())
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

    def _learn(self, mean: Array) -> None:
        self._learned = min(self._learned + 1, MEMORY)
        rate = 1.0 / self._learned
        self._spread += rate * (np.abs(mean - self._usual) - self._spread)
        self._usual += rate * (mean - self._usual)

    @property
    def due(self) -> bool:
        """Whether the keyframes are to be searched for now."""
        return self._count > 0 and self._since >= self._pause

    def search(self, surroundings: Surroundings, pose: Pose2) -> Found:
        """Where the last keyframes fit, the last one being at `pose`."""
        endpoint, frame = surroundings
        scan, here = panorama(self._seen_from_last()), frame @ pose
        believed = matched(endpoint, scan, here)
        close = matched(endpoint, scan, best_near(endpoint, scan, here, NEARBY))
        other = None
        if self._usual[0] > KNOWN:
            places = Places(endpoint, known=True, echoes=ECHOES, rated=True)
            other = places.best(scan, self._usual[0] - AS_USUAL)
        self._since = 0
        best = -math.inf if other is None else other.value
        if close.value > best - GAIN and self._fits(endpoint, scan, close, believed, GAIN_NEAR):
            self._pause, self.votes = PAUSE, 0
            moved = not near(close.pose, here, *MOVED)
            return Found(anchor=frame.inverse() @ close.pose if moved else None)
        if other is None or not self._fits(endpoint, scan, other, believed, GAIN):
            self._pause, self.votes = min(2 * self._pause, LONGEST_PAUSE), 0
            return Found()
        way, before = other.pose @ here.inverse(), self._way
        self.votes = self.votes + 1 if self.votes and agree(before @ here, other.pose) else 1
        self._way, self._pause = way, PAUSE
        return Found(elsewhere=self.votes >= VOTES)

    def _fits(
        self, endpoint: Endpoint, scan: Scan, place: Place, believed: Place, gain: float
    ) -> bool:
        """Whether the keyframes agree with the map as usual at a place, and better than at the
        believed one."""
        explained, wrong = endpoint.known_shares(scan.points, place.pose)
        usual = explained > self._usual[0] - AS_USUAL and wrong < self._usual[1] + AS_USUAL
        return usual and place.value > believed.value + gain

    def _seen_from_last(self) -> list[Keyframe]:
        """The keyframes in the frame of the last one."""
        found, pose = [], Pose2()
        for scan, step in reversed(self._steps):
            found.append(Keyframe(scan, pose))
            pose = pose @ step.inverse()
        return found[::-1]
