"""Loop closure: matching local maps that may show the same place."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, near, turned, wrap_angle
from slam.graph.bulk import Bulk
from slam.graph.covariance import MIN_INFORMATION
from slam.graph.global_search import GlobalSearch
from slam.graph.local_map import LocalMap, Panorama
from slam.interface import Posterior
from slam.maps.static import Static
from slam.motion.gaussian import Prediction
from slam.search.gauss_newton import GaussNewton
from slam.search.laplace import wide_information
from slam.sensor_models.endpoint import Endpoint, FrozenEndpoint, shares_of_known
from slam.validation import positive, whole

MAX_CACHE_BYTES = 40_000_000  # of the unpacked local maps, the last one aside
CORRIDOR_RATIO = 0.3  # of the information along to that across, below which a place is a corridor
CORRIDOR_STD = 0.3  # m, standard deviation along a corridor
SAME = 0.05, math.radians(1.0)  # m, rad, between climbs that end at one place
WEAK_PRIOR = np.array([0.3, 0.3, 0.1])  # m, m, rad, of a match: limits it where the map does not


class Match(NamedTuple):
    """The pose of a panorama in the frame of a local map.

    pose          of the panorama's frame
    information   (3, 3) about the pose, in the panorama's frame; less where others are likely, too
    explained     share of the echoes in occupied cells of the local map, not behind a wall
    contradicted  share of the echoes in free cells, or behind a wall
    behind        share of the echoes behind a wall (see `Endpoint.behind`)
    innovation    distance of the pose from its prediction, in standard deviations of both errors
                  (Mahalanobis), as if no other pose were likely
    off           m, distance of its position from the predicted one
    """

    pose: Pose2
    information: Array
    explained: float
    contradicted: float
    behind: float
    innovation: float
    off: float


@dataclass(frozen=True)
class Loops:
    """Parameters of the search for loops and of their acceptance.

    sigmas        half the width of the search window around the prediction, in standard deviations:
                  more than a Gaussian needs, since matches of distant scans err by more than their
                  covariance (on aces three closed the loop from 3 of 8 starts, seven from all)
    least         m, m, rad: minimum half width of the search window
    farthest      m, m, rad: maximum half width of the search window
    innovation    maximum innovation, in standard deviations, of a pose farther than `near` from its
                  prediction: true loops had at most 8.5 (aces), and those with a room that looks
                  alike, after a gap in the scans, 9.7 and more
    near          m; a room that looks alike is farther away
    explained     minimum share of the echoes that the other local map must explain
    contradicted  maximum share of the echoes in its free space: doors move
    floor         m, m, rad: standard deviations of the errors that a match's information lacks
    starts        number of candidates of the search that are refined: a coarse map shows the doors
                  of a passage alike
    refine        climbs from them to the local maxima
    """

    sigmas: float = 7.0
    least: tuple[float, float, float] = (0.15, 0.15, math.radians(2.0))
    farthest: tuple[float, float, float] = (8.0, 8.0, math.radians(45.0))
    innovation: float = 9.0
    near: float = 1.0
    explained: float = 0.45
    contradicted: float = 0.2
    floor: tuple[float, float, float] = (0.02, 0.02, math.radians(0.3))
    starts: int = 3
    refine: GaussNewton = field(default_factory=lambda: GaussNewton(levels=2))

    def __post_init__(self) -> None:
        positive(self, "sigmas", "innovation", "near", "explained", "contradicted")
        whole(self, "starts", 1)

    def accepts(self, match: Match) -> bool:
        """Whether the match is accepted as a loop."""
        agrees = match.explained >= self.explained and match.contradicted <= self.contradicted
        return agrees and (match.innovation <= self.innovation or match.off <= self.near)


class UnpackedMap:
    """A local map prepared for matching.

    nbytes  of its field and of the maxima for the search
    """

    def __init__(self, frozen: FrozenEndpoint):
        self.endpoint = frozen.unpacked()
        self.endpoint.field(level=1)
        self.search = GlobalSearch(self.endpoint)
        self.nbytes = self.endpoint.tiles.nbytes + self.search.nbytes


def cautious(information: Array) -> Array:
    """The information, limited along corridors.

    If a panorama is constrained much less along one direction than across it, it may as well lie
    elsewhere along it: the information in that direction is limited to that of CORRIDOR_STD.
    """
    known, axes = np.linalg.eigh(information[:2, :2])
    if known[0] >= CORRIDOR_RATIO * known[1] or known[0] <= CORRIDOR_STD**-2:
        return information
    share = np.eye(3)
    share[:2, :2] = (axes * np.sqrt([1.0 / (CORRIDOR_STD**2 * known[0]), 1.0])) @ axes.T
    return share @ information @ share


def mapped(place: LocalMap) -> Endpoint:
    """Build the static map of a local map's keyframes; returns its sensor model."""
    grid, endpoint = Static(), Endpoint()
    bulk = Bulk(grid)
    for scan, pose in place:
        bulk.integrate(scan, pose)
    endpoint.refresh(grid, bulk.finish())
    return endpoint


class Matcher:
    """Matches panoramas with local maps; recently used maps stay unpacked, others compressed."""

    def __init__(self, loops: Loops):
        self._loops = loops
        self._frozen: dict[LocalMap, FrozenEndpoint] = {}
        self._unpacked: OrderedDict[LocalMap, UnpackedMap] = OrderedDict()

    @property
    def nbytes(self) -> int:
        """Bytes of all maps kept."""
        return sum(frozen.nbytes for frozen in self._frozen.values()) + self._unpacked_bytes

    @property
    def _unpacked_bytes(self) -> int:
        return sum(unpacked.nbytes for unpacked in self._unpacked.values())

    def keep(self, place: LocalMap, endpoint: Endpoint) -> None:
        """Keep a compressed copy of the current map of `place`, given by its sensor model."""
        self._frozen[place] = FrozenEndpoint(endpoint)

    def pack(self) -> None:
        """Drop all unpacked maps, until they are matched again."""
        self._unpacked.clear()

    def forget(self, place: LocalMap) -> None:
        """Drop the map of `place`."""
        self._frozen.pop(place, None)
        self._unpacked.pop(place, None)

    def build(self, place: LocalMap) -> None:
        """Keep a compressed map of `place`, if there is none yet."""
        if place not in self._frozen:
            self.keep(place, mapped(place))

    def _unpacked_map(self, place: LocalMap) -> UnpackedMap:
        self.build(place)
        if place not in self._unpacked:
            self._unpacked[place] = UnpackedMap(self._frozen[place])
        self._unpacked.move_to_end(place)
        while len(self._unpacked) > 1 and self._unpacked_bytes > MAX_CACHE_BYTES:
            self._unpacked.popitem(last=False)
        return self._unpacked[place]

    def match(self, place: LocalMap, scan: Panorama, predicted: Pose2, covariance: Array) -> Match:
        """Match a panorama `scan` around its `predicted` pose, known with (3, 3) `covariance`: of
        the places that agree best in the coarse map of the search, and of the predicted one, the
        likeliest. Where others are nearly as likely, as along a corridor, it is known less well."""
        loops = self._loops
        reach = loops.sigmas * np.sqrt(np.diag(covariance))
        reach = np.clip(reach, loops.least, loops.farthest)
        unpacked = self._unpacked_map(place)
        starts = unpacked.search.candidates(scan.points, predicted, reach, most=loops.starts)
        endpoint = unpacked.endpoint
        matches = [self._at(endpoint, scan, start, predicted, covariance)
                   for start in (*starts, predicted)]  # fmt: skip
        values = [_log_posterior(endpoint, scan, one) for one in matches]
        best = max(range(len(matches)), key=values.__getitem__)
        spread = _spread([one.pose for one in matches], np.array(values), best)
        return matches[best]._replace(information=wider(matches[best].information, spread))

    def known_shares(
        self, places: Sequence[tuple[LocalMap, Pose2]], scan: Panorama
    ) -> tuple[float, float]:
        """Shares of a panorama's echoes that local maps explain together, and that they know and do
        not explain; each is given with the pose of the panorama in it."""
        known = np.zeros(len(scan.points), np.uint8)
        for place, pose in places:
            self._unpacked_map(place).endpoint.raise_known(known, scan.points, pose)
        return shares_of_known(known)

    def _at(
        self, endpoint: Endpoint, scan: Panorama, start: Pose2, predicted: Pose2, covariance: Array
    ) -> Match:
        """The match at the local maximum near `start`."""
        posterior = Posterior(endpoint, scan, Prediction(start, Pose2(), WEAK_PRIOR))
        pose = self._loops.refine.climb(posterior, start)
        information = cautious(wide_information(endpoint, scan, pose))
        information = tempered(information, pose.theta, self._loops.floor)
        explained, contradicted = endpoint.shares(scan.points, pose)
        behind = endpoint.behind(scan.points, scan.views, pose)
        deviations = innovation(pose, information, predicted, covariance)
        return Match(
            pose, information, explained - behind, contradicted + behind, behind, deviations,
            math.dist(pose[:2], predicted[:2]),
        )  # fmt: skip


def _spread(poses: Sequence[Pose2], values: Array, best: int) -> Array:
    """(3, 3) covariance of the positions of poses of these log posteriors (n,) about the best one,
    in its frame; of those that are the SAME, one counts."""
    others = [k for k, pose in enumerate(poses)
              if not any(near(pose, poses[m], *SAME) for m in (best, *range(k)))]  # fmt: skip
    off = np.array([[*poses[best].between(poses[k])[:2], 0.0] for k in others]).reshape(-1, 3)
    weights = np.exp(values[others] - values[best])
    return (weights * off.T) @ off / (1.0 + weights.sum())


def _log_posterior(endpoint: Endpoint, scan: Panorama, match: Match) -> float:
    """Nats; an echo behind a wall counts as one in a free cell."""
    likelihood = float(endpoint.log_likelihood(scan, np.array([match.pose]))[0])
    through = match.behind * len(scan.points) * (endpoint.top - endpoint.nothing)
    return likelihood - endpoint.beta * through - 0.5 * match.innovation**2


def tempered(information: Array, heading: float, floor: tuple[float, float, float]) -> Array:
    """The information in the frame of the pose, its covariance enlarged by that of the standard
    deviations `floor`."""
    turn = turned(heading)
    return wider(turn.T @ information @ turn, np.diag(np.square(floor)))


def wider(information: Array, more: Array) -> Array:
    """The information I if the covariance is enlarged by F: (I^-1 + F)^-1 = (1 + I F)^-1 I, which
    exists for singular I too."""
    result = np.linalg.solve(np.eye(3) + information @ more, information)
    return 0.5 * (result + result.T)


def innovation(pose: Pose2, information: Array, predicted: Pose2, covariance: Array) -> float:
    """The distance of two poses in standard deviations: one with (3, 3) information in its own
    frame, and one with a covariance."""
    turn = turned(pose.theta)
    matched = turn @ np.linalg.inv(information + np.diag(MIN_INFORMATION)) @ turn.T
    off = np.array(pose) - predicted
    off[2] = wrap_angle(off[2])
    return math.sqrt(off @ np.linalg.solve(covariance + matched, off))
