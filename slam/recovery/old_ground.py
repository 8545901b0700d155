"""Ground that was mapped long before: whether the robot is where it believes to be on it.

A robot that is carried along corridors which look alike draws a map that agrees with its next
scans, wherever it is. What it drew long before does not change with it.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple, Protocol

from slam.geometry import Pose2, near
from slam.graph.local_map import Panorama
from slam.recovery.places import THOROUGH, Place, Places, Surroundings, best_near, matched
from slam.recovery.watch import MISPLACED

RECENT = 5  # stretches before the last one, which are not old: they agree with it anywhere
LEAST_KNOWN = 0.4  # share of the echoes that old ones know, or they do not judge,
CLEARLY_WRONG = 0.2, 2.0  # or that they do not explain, and so many times those that they do
WINDOW = 3  # stretches, whose mean counts (missing ones are as usual), and which are searched for
KEYFRAMES = 100  # of them, at most
USUAL, MEMORY = 0.03, 20  # share of known echoes unexplained, at first; stretches of its mean
UNUSUAL = 0.02  # more than usual: is searched for
LEARNED = 0.1  # more than usual, at most, that a stretch counts in the mean
DISMISSED = 4  # the same as MEMORY, of what was searched for in vain
LONGEST_PAUSE = 16  # stretches between two searches; doubled by two that find nothing
ECHOES = 80  # that are searched for
DRIFT = 1.0, 1.0, math.radians(10.0)  # m, m, rad, of a loop that is not closed yet
KNOWN, WRONG = 0.7, 0.1  # share of the echoes that the map knows here, or does not explain
GAIN, MORE_EXPLAINED = 8.0, 0.05  # nats, and share of the echoes, more at another place,
LEAST_EXPLAINED = 0.6  # which explains so many at least: a bent stretch fits badly anywhere,
MISFIT = 0.1  # and leaves so many more than usual unexplained, at most, and less than here
EXPECTED, NOT_HERE = 6.0, 20.0  # nats: another place fits better by so many where the robot is
# right; wherever it is, it is not here, once the searches exceed that by so many together
CLEARLY_BETTER = 40.0, 0.4, 0.35  # after a dropped doubt: nats, share of the echoes that the other
# place explains at least, where this one is KNOWN or wrong, and of the known ones that it does not,
# at most
SURELY_NOT_HERE = 34.0  # nats instead of NOT_HERE, then: what raised the doubt is seen here
HELD = 20  # stretches after a dropped doubt, at most, that do not become old while it is open
SAME = 1.0, math.radians(10.0)  # m, rad, of finds that agree: wrong loops move the believed place


class Other(NamedTuple):
    """A pose in the old map that fits better than the believed one there, by `gain` nats."""

    here: Pose2
    pose: Pose2
    gain: float


class Ground(Protocol):
    """Stretches of some metres of the path, the last of which is judged by what was drawn long
    before it."""

    @property
    def ordinal(self) -> int:
        """The number of stretches before the last one."""
        ...

    def unexplained(self, scan: Panorama) -> float | None:
        """See `share`: of the last stretch, of which `scan` is the panorama in its frame."""
        ...

    def last(self, begin: int) -> Panorama:
        """The last KEYFRAMES of the last WINDOW stretches, of those from ordinal `begin` on, as one
        scan at the frame."""
        ...

    def old(self) -> Surroundings:
        """What was drawn long before, and the frame of the last stretch in it; valid until the next
        call."""
        ...


def share(explained: float, other: float) -> float | None:
    """The share of the echoes, of those that old stretches know, which they do not explain, by the
    shares that they explain, and that they know and do not; None, if they know too few."""
    least, times = CLEARLY_WRONG
    enough = explained + other > LEAST_KNOWN or other > max(least, times * explained)
    return other / (explained + other) if enough else None


class OldGround:
    """Judges each stretch by what was drawn long before it. If that explains less of it than usual,
    it is searched for another place.

    A doubt that was dropped, as other places explained the scans no better, may have been right:
    then all that was drawn before it is old ground, and less is asked of another place, until old
    ground agrees with a stretch. The same where a lost robot goes on on new ground.

    votes     searches in a row that found the same other place; MISPLACED at least, once they show
              together that the robot is not here (cumulative sum, Page 1954)
    open      whether a doubt was dropped, and old ground has agreed with no stretch since
    arriving  whether the robot came from new ground, and old ground has not agreed with it since
    """

    def __init__(self) -> None:
        self.votes, self._excess = 0, 0.0
        self.open = self.arriving = False
        self._usual = USUAL
        self._shares: deque[float] = deque(maxlen=WINDOW)
        self._way = Pose2()  # from the believed place to the other, by the last search
        self._begin = 0  # ordinal of the first stretch since the robot was found
        self._unknown = 0  # stretches in a row that lie on new ground
        self._wait, self._fails = 0, 0  # stretches until the next search; searches in vain

    def begin(self, ordinal: int) -> None:
        """The robot was found again: stretches from this one on are where they seem to be."""
        self._begin = ordinal
        self._unknown, self.arriving = 0, False
        self._wait = self._fails = 0
        self._forget_doubt()

    def doubt(self) -> None:
        """A doubt was dropped before the next stretch."""
        self.open = True
        self._wait = self._fails = 0
        self._forget_doubt()

    def _forget_doubt(self) -> None:
        self.votes, self._excess = 0, 0.0
        self._shares.clear()

    def judge(self, ground: Ground, scan: Panorama) -> None:
        """Judge the last stretch of the `ground`, of which `scan` is the panorama."""
        if ground.ordinal < self._begin:
            return
        unexplained = ground.unexplained(scan)
        if unexplained is None:
            self._unknown += 1
            if self._unknown == WINDOW:
                self.arriving = True
                self._forget_doubt()
            return
        self._unknown = 0
        self._shares.append(unexplained)
        self._wait -= 1
        missing = WINDOW - len(self._shares)
        mean = (sum(self._shares) + missing * self._usual) / WINDOW
        few = not self.open and ground.ordinal < self._begin + WINDOW - 1
        if mean < self._usual + UNUSUAL or few:
            self._learn(unexplained, MEMORY)
            self.votes, self._excess = 0, 0.0
            self.open = self.arriving = False
            if self._wait <= 0:
                self._fails = 0
        elif self._wait <= 0:
            self._vote(self._elsewhere(ground))
            self._wait = min(1 << self._fails // 2, LONGEST_PAUSE)
            if not self.votes:
                self._learn(mean, DISMISSED)

    def _learn(self, unexplained: float, memory: int) -> None:
        self._usual += min(unexplained - self._usual, LEARNED) / memory

    def _vote(self, other: Other | None) -> None:
        """Count a vote for a place instead of the believed one."""
        gain = 0.0 if other is None else other.gain
        self._excess = max(self._excess + gain - EXPECTED, 0.0)
        if other is None:
            self.votes, self._fails = 0, self._fails + 1
            return
        before, self._way = self._way, other.pose @ other.here.inverse()
        agree = self.votes > 0 and near(before @ other.here, other.pose, *SAME)
        self.votes = self.votes + 1 if agree else 1
        if self._excess > (SURELY_NOT_HERE if self.open else NOT_HERE):
            self.votes = max(self.votes, MISPLACED)
        self._fails = 0

    def _elsewhere(self, ground: Ground) -> Other | None:
        """The place of the frame at which the last stretches fit much better."""
        endpoint, frame = ground.old()
        scan = ground.last(self._begin)
        starts = frame, best_near(endpoint, scan, frame, DRIFT)
        here = max((matched(endpoint, scan, start) for start in starts), key=_value)
        explained, wrong = endpoint.known_shares(scan.points, here.pose)
        known, twice = explained + wrong > KNOWN, CLEARLY_WRONG[1] * explained
        if not known and wrong < max(explained if self.open else twice, WRONG):
            return None  # new ground
        better, enough, most_wrong = CLEARLY_BETTER
        lax = self.open and (known or wrong > twice)
        least = max(explained + MORE_EXPLAINED, enough if lax else LEAST_EXPLAINED)
        places = Places(endpoint, known=True, echoes=ECHOES, rating=THOROUGH)
        found = places.best(scan, least, here.value + GAIN)
        if found is None or found.value < here.value + GAIN:
            return None
        gain = found.value - here.value
        there, wrong_there = endpoint.known_shares(scan.points, found.pose)
        if there <= least:
            return None
        unexplained = wrong_there / (there + wrong_there)
        most = min(wrong / (explained + wrong), self._usual + MISFIT)
        fits = there > LEAST_EXPLAINED and unexplained < most
        clear = self.open and unexplained < most_wrong and gain > better
        return Other(frame, found.pose, gain) if fits or clear else None


def _value(place: Place) -> float:
    return place.value
