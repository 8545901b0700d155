"""Pose information: bits about the pose gained by revisiting a place with a well-known pose.

From Bourgault et al. (2002): the localisation's bits are added to the map's, with a weight. From
Stachniss, Grisetti and Burgard (2005): places visited before are candidates, and a revisit reduces
the uncertainty to that of the first visit. Instead of their particle filter, the SLAM's covariance
measures it.
"""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from slam.geometry import Array

DRIFT_VARIANCE = 1e-4  # m^2 per m: of the position, by scan matching in new places (1 cm after 1 m)
MATCH_VARIANCE = 2.5e-5  # m^2, of a match with a known place: 5 mm
PLACE_SPACING = 1.0  # m, between recorded places
REVISIT_DISTANCE = 1.5  # m, within which a place is recognised
BIT_WEIGHT = 20.0  # map bits per pose bit: the whole map depends on the pose
RECENT_PLACES = 3  # the last places recorded are not revisits


class PoseInformation:
    """Places with the variance, m^2, of the position at the first visit."""

    def __init__(self) -> None:
        self._places: list[tuple[float, float]] = []
        self._variances: list[float] = []
        self._variance = MATCH_VARIANCE

    def follow(self, planning: PlanningSnapshot) -> None:
        """Take the variance from the SLAM's covariance; record the place, if it is a new one."""
        here, position = planning.position, planning.covariance[:2, :2]
        self._variance = MATCH_VARIANCE + math.sqrt(max(float(np.linalg.det(position)), 0.0))
        if not self._places or min(math.dist(here, p) for p in self._places) >= PLACE_SPACING:
            self._places.append(here)
            self._variances.append(self._variance)

    def places(self) -> Array:
        """(k, 2) m, the places visited before."""
        return np.array(self._places[:-RECENT_PLACES]).reshape(-1, 2)

    def bits(self, points: Array, lengths: Array) -> Array:
        """(n,) weighted bits: the reduction of the entropy of x and y, both Gaussian."""
        before = self._variance + DRIFT_VARIANCE * lengths
        after = np.minimum(before, self._known(points) + MATCH_VARIANCE)
        return BIT_WEIGHT * np.log2(before / after)

    def _known(self, points: Array) -> Array:
        """(n,) m^2, the least variance of earlier places near each of points (n, 2), m; or inf."""
        places, variances = self.places(), np.array(self._variances[:-RECENT_PLACES])
        if not len(places):
            return np.full(len(points), np.inf)
        distance = np.linalg.norm(points[:, None] - places[None], axis=2)
        return np.where(distance < REVISIT_DISTANCE, variances, np.inf).min(axis=1)
