"""The places of a map that a scan may have been taken at: the best one, and the best other one."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Pose2
from slam.graph.global_search import OTHER_DISTANCE, OTHER_TURN, GlobalSearch
from slam.interface import Posterior
from slam.motion.gaussian import Prediction
from slam.recovery.lost_belief import Agreement
from slam.scan import Scan
from slam.search.gauss_newton import GaussNewton
from slam.sensor_models.endpoint import Endpoint

SEARCHED = 60.0  # m around a pose, of the map in which it is searched for
WEAK_PRIOR = np.array([0.3, 0.3, 0.1])  # m, m, rad, of a match: limits it where the map does not
REFINE = GaussNewton(levels=2)


class Place(NamedTuple):
    """A pose in the map, the log-likelihood of the scan there, and how the map agrees with it."""

    pose: Pose2
    value: float
    agreement: Agreement


class Places:
    """A map prepared for the search of places, within SEARCHED of a pose."""

    def __init__(self, endpoint: Endpoint, around: Pose2):
        here = np.array(around[:2])
        self._endpoint = endpoint
        self._search = GlobalSearch(endpoint, (here - SEARCHED, here + SEARCHED))

    def best(self, scan: Scan) -> Place:
        """The place at which the map agrees best with the scan."""
        region = self._search
        return self.near(scan, region.best(scan.points, region.centre, region.reach))

    def best_but(self, scan: Scan, pose: Pose2) -> Place:
        """The best place that is not near a pose; refined, unless that leads to the pose."""
        region = self._search
        start = region.best(scan.points, region.centre, region.reach, but=pose)
        place = self.near(scan, start)
        return at(self._endpoint, scan, start) if same_place(place.pose, pose) else place

    def near(self, scan: Scan, start: Pose2) -> Place:
        """The place at the local maximum near a pose."""
        prior = Prediction(start, Pose2(), WEAK_PRIOR)
        return at(self._endpoint, scan, REFINE.climb(Posterior(self._endpoint, scan, prior), start))


def at(endpoint: Endpoint, scan: Scan, pose: Pose2) -> Place:
    """The place at a pose."""
    value = endpoint.log_likelihood(scan, np.array([pose]))[0]
    return Place(pose, float(value), Agreement(*endpoint.shares(scan, pose)))


def same_place(one: Pose2, other: Pose2) -> bool:
    """Whether two poses are so near that a search regards them as one place."""
    apart = one.between(other)
    return math.hypot(apart.x, apart.y) <= OTHER_DISTANCE and abs(apart.theta) <= OTHER_TURN
