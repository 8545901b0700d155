"""The places of a map that a scan may have been taken at, the best one first."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, near
from slam.graph.global_search import OTHER_DISTANCE, GlobalSearch
from slam.graph.kept_places import OTHER_TURN
from slam.recovery.agreement import Agreement
from slam.scan import Scan
from slam.search.gauss_newton import GaussNewton, climbed
from slam.sensor_models.endpoint import Endpoint

FARTHEST = 12.0  # m, of the echoes that are searched for
FEW, MANY = 60, 150  # echoes: of a scan, and of many scans together
TURN_STEP = math.radians(2.0)  # between candidates
WIDE = 1.0, 1.0, math.radians(100.0)  # m, m, rad: a window for a robot whose odometry failed,
MARGIN = 0.5  # m, of the map around its echoes,
FINE_TURN_STEP = math.radians(1.0)  # between its candidates
WELL_EXPLAINED = -0.4  # mean log-likelihood of an echo, at the candidate nearest to its place
CANDIDATES = 16  # of a search in its coarse map, which are compared in the map itself
APART = 0.25  # m between them, where places look alike: they are rated
RATED_BY = 100  # echoes, in the map itself,
ROUGHLY = 6, 0.005  # after so many steps uphill, the last of so many m and rad;
FINALISTS = 32  # the best of them are matched
STEP = 0.05  # m between points of a path: a wall is wider in the field
SAME_DISTANCE, SAME_TURN = 0.3, math.radians(10.0)  # m, rad, of finds that agree
WEAK_PRIOR = np.array([0.3, 0.3, 0.1])  # m, m, rad, of a match: limits it where the map does not
CLOSELY = GaussNewton().limits  # of a climb in the map: steps, and m and rad of the last one
Reach = tuple[float, float, float]  # m, m, rad: half the width of a window


class Rating(NamedTuple):
    """How many candidates of a coarse map are rated in the map itself, and whether the coarse one
    is `widened` (see `GlobalSearch`)."""

    number: int
    widened: bool


CAREFUL = Rating(1024, False)  # a place is to be accepted: few are found that are none
THOROUGH = Rating(512, True)  # it is asked whether there is another place: few are missed


class Place(NamedTuple):
    """A pose in the map, the log-likelihood of the scan there, and how the map agrees with it."""

    pose: Pose2
    value: float
    agreement: Agreement


class Surroundings(NamedTuple):
    """The map in which a robot is searched for, and the pose of the SLAM's frame in it."""

    endpoint: Endpoint
    frame: Pose2


class Places:
    """A map prepared for the search of places."""

    def __init__(
        self,
        endpoint: Endpoint,
        *,
        known: bool = False,
        echoes: int = FEW,
        candidates: int = CANDIDATES,
        rating: Rating | None = None,
    ):
        """A search takes the best of so many `candidates`, by at most so many `echoes`.

        known   see `GlobalSearch`
        rating  of more of them, of which the best are taken: in a building whose corridors look
                alike hundreds of places are as good in the coarse map as the true one
        """
        self._endpoint, self._echoes, self._rating = endpoint, echoes, rating
        self._most = FINALISTS if rating else candidates
        widened = rating is not None and rating.widened
        self._search = GlobalSearch(endpoint, known=known, widened=widened)

    def best(self, scan: Scan, explained: float, value: float = -math.inf) -> Place | None:
        """The place at which the map agrees best with the scan, if it explains that share of it;
        most of those worse than `value`, nats, are left out, as the coarse map tells roughly."""
        least = max(self._least(explained), self._mean(scan, value))
        return next(iter(self._found(scan, least, [])), None)

    def all(self, scan: Scan, explained: float) -> list[Place]:
        """The places of the candidates that explain so large a share in the coarse map."""
        starts = self._starts(scan, self._least(explained), [])
        return [at(self._endpoint, scan, top) for top in _tops(self._endpoint, scan, starts)]

    def crossed(self, path: Array) -> bool:
        """Whether a path (n, 2), m, leads through a wall."""
        driven = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        steps = np.arange(0.0, driven[-1], STEP)
        points = np.column_stack([np.interp(steps, driven, along) for along in path.T])
        return self._endpoint.shares(points, Pose2())[0] > 0.0

    def better_than(self, scan: Scan, place: Place, gain: float, explained: float) -> list[Place]:
        """Other places that explain so large a share of the scan, where it is by `gain` nats more
        likely than at `place`; the best one first."""
        least = max(self._least(explained), self._mean(scan, place.value + gain))
        found = self._found(scan, least, [place.pose])
        return [other for other in found if other.value > place.value + gain]

    def _found(self, scan: Scan, least: float, but: list[Pose2]) -> list[Place]:
        """The candidates with at least so large a mean log-likelihood in the coarse map of the
        search, the most likely one first; `but` are places that are not considered."""
        starts = self._starts(scan, least, but)
        climbs = zip(_tops(self._endpoint, scan, starts), starts, strict=True)
        poses = [start if _among(but, top) else top for top, start in climbs]
        found = [at(self._endpoint, scan, pose) for pose in poses]
        return sorted(found, key=lambda place: -place.value)

    def _starts(self, scan: Scan, least: float, but: list[Pose2]) -> list[Pose2]:
        region = self._search
        points, centre, reach = searched(scan, self._echoes), region.centre, region.reach
        rating = self._rating
        most, apart = (rating.number, APART) if rating else (self._most, OTHER_DISTANCE)
        found = region.candidates(points, centre, reach, but, TURN_STEP, least, most, apart)
        return self._likeliest(scan, found)

    def _likeliest(self, scan: Scan, starts: list[Pose2]) -> list[Pose2]:
        """Some poses, or the best of the local maxima near them if they are too many."""
        if len(starts) <= self._most:
            return starts
        points, endpoint = scan.points[:: math.ceil(len(scan.points) / RATED_BY)], self._endpoint
        readings = endpoint.reading(1), endpoint.reading(0)
        tops, values = climbed(np.array(starts), points, *readings, WEAK_PRIOR, ROUGHLY)
        found: list[Pose2] = []
        for k in np.argsort(-values, kind="stable"):
            pose = Pose2.of(tops[k])
            if not any(agree(pose, other) for other in found):
                found.append(pose)
            if len(found) == self._most:
                break
        return found

    def _least(self, explained: float) -> float:
        """Mean log-likelihood of echoes of which this share is explained."""
        return explained * WELL_EXPLAINED + (1.0 - explained) * self._endpoint.nothing

    def _mean(self, scan: Scan, value: float) -> float:
        """Mean log-likelihood of an echo where that of the scan is `value`."""
        return value / (self._endpoint.beta * max(len(scan.points), 1))

    def matched(self, scan: Scan, start: Pose2) -> Place:
        """The place at the local maximum near a pose."""
        return matched(self._endpoint, scan, start)


def best_near(endpoint: Endpoint, scan: Scan, pose: Pose2, reach: Reach) -> Pose2:
    """The pose of a window around `pose` at which the coarse map agrees best with the scan."""
    points, around = searched(scan), np.array(pose[:2])
    size = float(np.hypot(*points.T).max(initial=0.0)) + max(reach[:2]) + MARGIN
    region = GlobalSearch(endpoint, (around - size, around + size))
    return region.best(points, pose, np.array(reach), turn_step=FINE_TURN_STEP)


def matched(endpoint: Endpoint, scan: Scan, start: Pose2) -> Place:
    """The place at the local maximum of the likelihood near a pose."""
    return at(endpoint, scan, _tops(endpoint, scan, [start])[0])


def _tops(endpoint: Endpoint, scan: Scan, starts: list[Pose2]) -> list[Pose2]:
    """The local maxima of the likelihood near some poses."""
    if not starts:
        return []
    readings = endpoint.reading(1), endpoint.reading(0)
    tops, _ = climbed(np.array(starts), scan.points, *readings, WEAK_PRIOR, CLOSELY)
    return [Pose2.of(top) for top in tops]


def searched(scan: Scan, most: int = FEW) -> Array:
    """(n, 2) echoes within FARTHEST, at most so many."""
    points = scan.points[np.hypot(*scan.points.T) <= FARTHEST]
    return points[:: math.ceil(max(len(points), 1) / most)]


def at(endpoint: Endpoint, scan: Scan, pose: Pose2) -> Place:
    """The place at a pose."""
    value = endpoint.log_likelihood(scan, np.array([pose]))[0]
    return Place(pose, float(value), Agreement(*endpoint.shares(scan.pieces, pose)))


def _among(places: list[Pose2], pose: Pose2) -> bool:
    """Whether a pose is one of some places."""
    return any(same_place(pose, other) for other in places)


def same_place(one: Pose2, other: Pose2) -> bool:
    """Whether a search regards two poses as one place."""
    return near(one, other, OTHER_DISTANCE, OTHER_TURN)


def agree(one: Pose2, other: Pose2) -> bool:
    """Whether two searches found the same pose."""
    return near(one, other, SAME_DISTANCE, SAME_TURN)
