"""Ground that was mapped long before: whether the robot is where it believes to be on it.

A robot that is carried along corridors which look alike draws local maps that agree with its next
scans, wherever it is. What it drew long before does not change with it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, compose
from slam.graph.local_map import Keyframe, LocalMap, Panorama, panorama
from slam.graph.loops import Matcher
from slam.graph.whole_map import SearchedMap
from slam.recovery.places import MANY, Place, Places, Surroundings, best_near, matched, near

RECENT = 5  # local maps before the last one, which are not old: they agree with it anywhere
NEAREST, FARTHEST = 4, 8.0  # old local maps, at most, that judge; m, between centres
LEAST_KNOWN = 0.4  # share of the echoes that they know, or they do not judge
WINDOW = 3  # local maps, whose mean counts, and which are searched for
KEYFRAMES = 100  # of them, at most
USUAL, MEMORY = 0.03, 20  # share of known echoes unexplained, at first; local maps of its mean
UNUSUAL = 0.02  # more than usual: is searched for
LEARNED = 0.1  # more than usual, at most, that a local map counts in the mean
DISMISSED = 8  # the same as MEMORY, of what was searched for in vain
LONGEST_PAUSE = RECENT  # local maps between two searches
DRIFT = 1.0, 1.0, math.radians(10.0)  # m, m, rad, of a loop that is not closed yet
KNOWN, WRONG = 0.7, 0.15  # share of the echoes that the map knows here, or does not explain
GAIN, MORE_EXPLAINED = 8.0, 0.05  # nats, and share of the echoes, more at another place
NOT_HERE = 20.0  # nats: wherever the robot is, it is not here
SAME = 1.0, math.radians(10.0)  # m, rad, of finds that agree: wrong loops move the believed place


class Other(NamedTuple):
    """A place that fits better than the believed one, by so many nats."""

    pose: Pose2
    gain: float


class Ground(NamedTuple):
    """Local maps, the last of which is judged by the old ones.

    places   in the order of time
    poses    (n, 3) of their frames
    middles  their centres, each in its frame
    matcher  reads them
    """

    places: Sequence[LocalMap]
    poses: Array
    middles: Sequence[Pose2]
    matcher: Matcher

    @property
    def frame(self) -> Pose2:
        """The frame of the last one."""
        return Pose2.of(self.poses[-1])

    def unexplained(self, scan: Panorama) -> float | None:
        """The share of a panorama's echoes, of those that the nearest old local maps know, which
        they do not explain; None, if they know too few."""
        centres = compose(self.poses, np.array(self.middles))
        apart = np.hypot(*(centres[: _old(self.places), :2] - centres[-1, :2]).T)
        chosen = [int(k) for k in np.argsort(apart, kind="stable")[:NEAREST] if apart[k] < FARTHEST]
        judges = [(self.places[k], Pose2.of(self.poses[k]).between(self.frame)) for k in chosen]
        explained, other = self.matcher.known_shares(judges, scan)
        return other / (explained + other) if explained + other > LEAST_KNOWN else None

    def last(self, begin: int) -> Panorama:
        """The last keyframes, of local maps from ordinal `begin` on, as one scan at the frame."""
        found = []
        for place, pose in zip(self.places[-WINDOW:], self.poses[-WINDOW:], strict=True):
            if place.ordinal >= max(begin, self.places[-1].ordinal - WINDOW + 1):
                away = self.frame.between(Pose2.of(pose))
                found += [Keyframe(one.scan.bare(), away @ one.pose) for one in place.keyframes]
        return panorama(found[-KEYFRAMES:])


class OldGround:
    """Judges each finished local map by those drawn long before it. If they explain less of it than
    usual, these are searched for another place.

    votes  searches in a row that found the same other place, or that the robot is not here
    """

    def __init__(self) -> None:
        self.votes = 0
        self._map = SearchedMap()
        self._usual = USUAL
        self._shares: deque[float] = deque(maxlen=WINDOW)
        self._other = Other(Pose2(), 0.0)  # the last one found; there @ here^-1
        self._begin = 0  # ordinal of the first local map since the robot was found
        self._unknown = 0  # local maps in a row that lie on new ground
        self._wait, self._fails = 0, 0  # local maps until the next search; searches in vain

    @property
    def nbytes(self) -> int:
        """Bytes of the map that is searched."""
        return self._map.nbytes

    def forget(self, number: int) -> None:
        """See `WholeMap.forget`."""
        self._map.forget(number)

    def pack(self) -> None:
        """Drop the map, until it is searched again."""
        self._map = SearchedMap()

    def begin(self, ordinal: int) -> None:
        """The robot was found again: local maps from this one on are where they seem to be."""
        self._begin = ordinal
        self._wait = self._fails = 0
        self._forget_doubt()

    def _forget_doubt(self) -> None:
        self.votes = 0
        self._shares.clear()

    def surroundings(self, places: Sequence[LocalMap], poses: Array) -> Surroundings:
        """The map of the old ones of the local maps, at `poses` (n, 3), and the last frame in it.
        Valid until the next call."""
        old = _old(places)
        return Surroundings(self._map.endpoint(places[:old], poses[:old]), Pose2.of(poses[-1]))

    def judge(self, ground: Ground, scan: Panorama) -> None:
        """Judge the last local map of the `ground`, of which `scan` is the panorama."""
        if ground.places[-1].ordinal < self._begin:
            return
        share = ground.unexplained(scan)
        if share is None:
            self._unknown += 1
            if self._unknown == WINDOW:
                self._forget_doubt()
            return
        self._unknown = 0
        self._shares.append(share)
        self._wait -= 1
        mean = sum(self._shares) / len(self._shares)
        if len(self._shares) < WINDOW or mean < self._usual + UNUSUAL:
            self._learn(share, MEMORY)
            self.votes = 0
            if self._wait <= 0:
                self._fails = 0
        elif self._wait <= 0:
            self._vote(ground.frame, self._elsewhere(ground))
            self._wait = min(1 + self._fails // 2, LONGEST_PAUSE)
            if not self.votes:
                self._learn(mean, DISMISSED)

    def _learn(self, share: float, memory: int) -> None:
        self._usual += min(share - self._usual, LEARNED) / memory

    def _vote(self, here: Pose2, other: Other | None) -> None:
        """Count a vote for a place instead of the believed one."""
        if other is None:
            self.votes, self._fails = 0, self._fails + 1
            return
        before, self._other = self._other, Other(other.pose @ here.inverse(), other.gain)
        not_here = min(before.gain, other.gain) > NOT_HERE
        agree = not_here or near(before.pose @ here, other.pose, *SAME)
        self.votes = self.votes + 1 if self.votes and agree else 1
        self._fails = 0

    def _elsewhere(self, ground: Ground) -> Other | None:
        """The place of the last frame at which the last local maps fit much better."""
        ground.matcher.pack()  # makes room for the map of all
        endpoint, frame = self.surroundings(ground.places, ground.poses)
        scan = ground.last(self._begin)
        starts = frame, best_near(endpoint, scan, frame, DRIFT)
        here = max((matched(endpoint, scan, start) for start in starts), key=_value)
        explained, wrong = endpoint.known_shares(scan.points, here.pose)
        if explained + wrong < KNOWN and wrong < max(explained, WRONG):
            return None  # new ground
        found = Places(endpoint, known=True, echoes=MANY, rated=True).best(scan, explained)
        if found is None or found.value < here.value + GAIN:
            return None
        there, _ = endpoint.known_shares(scan.points, found.pose)
        other = Other(found.pose, found.value - here.value)
        return other if there > explained + MORE_EXPLAINED else None


def _old(places: Sequence[LocalMap]) -> int:
    """The number of local maps that were drawn long before the last one."""
    return sum(place.ordinal < places[-1].ordinal - RECENT for place in places)


def _value(place: Place) -> float:
    return place.value
