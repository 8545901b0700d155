"""Loops: how two local maps lie to each other, if they show the same place."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, turned
from slam.graph.global_search import GlobalSearch
from slam.graph.local_map import LocalMap
from slam.interface import Posterior
from slam.maps.static import Static
from slam.motion.gaussian import Prediction
from slam.scan import Scan
from slam.search.gauss_newton import GaussNewton
from slam.search.laplace import wide_information
from slam.sensor_models.endpoint import Endpoint, FrozenEndpoint
from slam.validation import positive

MOST_BYTES = 100_000_000  # of the maps that are kept ready, the last one aside
PASSAGE = 0.3  # of the information across: with less along it, a place is taken for a passage
SLIDE = 0.3  # m, standard deviation along a passage
LOOSE = np.array([0.3, 0.3, 0.1])  # m, m, rad: what holds a match where the map leaves it free


class Match(NamedTuple):
    """Where a panorama was taken, in the frame of a local map.

    pose          of the panorama's frame
    information   (3, 3) about it, in the panorama's frame
    explained     share of the echoes where something stands in the local map
    contradicted  share of the echoes where it is free
    """

    pose: Pose2
    information: Array
    explained: float
    contradicted: float


@dataclass(frozen=True)
class Loops:
    """How loops are looked for, and which are believed.

    sigmas        how many standard deviations around the prediction are searched: more than a
                  Gaussian asks for, since where scans are far apart a match errs by more than it
                  knows (on aces three closed the loop from 3 of 8 beginnings, seven from all)
    least         m, m, rad: so far is searched in any case
    farthest      m, m, rad: farther is never
    explained     share of the echoes at least that the other local map must explain
    contradicted  share of the echoes at most that may lie where it is free: doors move
    floor         m, m, rad: standard deviations of what a match does not know of its error
    refine        climbs from the best candidate to the top of its peak
    """

    sigmas: float = 7.0
    least: tuple[float, float, float] = (0.15, 0.15, math.radians(2.0))
    farthest: tuple[float, float, float] = (8.0, 8.0, math.radians(45.0))
    explained: float = 0.45
    contradicted: float = 0.2
    floor: tuple[float, float, float] = (0.02, 0.02, math.radians(0.3))
    refine: GaussNewton = field(default_factory=lambda: GaussNewton(levels=2))

    def __post_init__(self) -> None:
        positive(self, "sigmas", "explained", "contradicted")

    def believed(self, match: Match) -> bool:
        """Whether the two show the same place."""
        return match.explained >= self.explained and match.contradicted <= self.contradicted


class Ready:
    """A local map that can be matched with.

    nbytes  of what is read of it, and of what is searched in it
    """

    def __init__(self, settled: FrozenEndpoint):
        self.reading = settled.unpacked()
        self.reading.field(level=1)
        self.search = GlobalSearch(self.reading)
        self.nbytes = self.reading.tiles.nbytes + self.search.nbytes


def cautious(information: Array) -> Array:
    """The information without what a passage pretends to know of the way along it.

    Where the map holds the place of a panorama much less in one direction than across it, the
    panorama may as well lie elsewhere along it: such a direction keeps the information of
    SLIDE at most.
    """
    known, axes = np.linalg.eigh(information[:2, :2])
    if known[0] >= PASSAGE * known[1] or known[0] <= SLIDE**-2:
        return information
    share = np.eye(3)
    share[:2, :2] = (axes * np.sqrt([1.0 / (SLIDE**2 * known[0]), 1.0])) @ axes.T
    return share @ information @ share


def mapped(place: LocalMap) -> Endpoint:
    """The reading of a local map that nobody made."""
    grid, reading = Static(), Endpoint()
    changed = [grid.integrate(scan, pose) for scan, pose in place]
    reading.refresh(grid, np.concatenate(changed))
    return reading


class Matcher:
    """Matches panoramas with local maps. Those used last are kept ready, the others small."""

    def __init__(self, loops: Loops):
        self._loops = loops
        self._settled: dict[LocalMap, FrozenEndpoint] = {}
        self._ready: OrderedDict[LocalMap, Ready] = OrderedDict()

    @property
    def nbytes(self) -> int:
        """Bytes of what is kept."""
        return sum(settled.nbytes for settled in self._settled.values()) + self._ready_bytes

    @property
    def _ready_bytes(self) -> int:
        return sum(ready.nbytes for ready in self._ready.values())

    def keep(self, place: LocalMap, reading: Endpoint) -> None:
        """The map of `place`, which somebody made already, as it is read now."""
        self._settled[place] = FrozenEndpoint(reading)

    def _made_ready(self, place: LocalMap) -> Ready:
        if place not in self._settled:
            self.keep(place, mapped(place))
        if place not in self._ready:
            self._ready[place] = Ready(self._settled[place])
        self._ready.move_to_end(place)
        while len(self._ready) > 1 and self._ready_bytes > MOST_BYTES:
            self._ready.popitem(last=False)
        return self._ready[place]

    def match(self, place: LocalMap, scan: Scan, predicted: Pose2, covariance: Array) -> Match:
        """Where a panorama was taken, near where it is predicted, with (3, 3) `covariance`."""
        loops = self._loops
        reach = loops.sigmas * np.sqrt(np.diag(covariance))
        reach = np.clip(reach, loops.least, loops.farthest)
        ready = self._made_ready(place)
        start = ready.search.best(scan.points, predicted, reach)
        posterior = Posterior(ready.reading, scan, Prediction(start, Pose2(), LOOSE))
        pose = loops.refine.climb(posterior, start)
        information = cautious(wide_information(ready.reading, scan, pose))
        shares = ready.reading.shares(scan, pose)
        return Match(pose, self._tempered(information, pose.theta), *shares)

    def _tempered(self, information: Array, heading: float) -> Array:
        """The information in the frame of the pose, its error widened by the floor:
        (I^-1 + F)^-1 = (1 + I F)^-1 I, which can be had where I has no inverse."""
        turn = turned(heading)
        own = turn.T @ information @ turn
        wider = np.linalg.solve(np.eye(3) + own * np.square(self._loops.floor), own)
        return 0.5 * (wider + wider.T)
