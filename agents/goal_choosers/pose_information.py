"""What revisiting a place where the pose was well known brings for the pose.

From Bourgault et al. (2002): the localisation's bits are added to the map's, with a weight. From
Stachniss, Grisetti and Burgard (2005): places visited before are candidates, and the uncertainty
that a revisit leaves is that of the first visit. Their particle filter is not here: the SLAM's own
covariance stands for it.
"""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.navigation.site import PatrolView
from dynslam_env.navigation.survey import PlanningSnapshot
from slam.geometry import Array

DRIFT = 1e-4  # m^2 a metre: of the position, by scan matching in new places (1 cm after 1 m)
MATCH = 2.5e-5  # m^2, of a match with a known place: 5 mm
SPACING = 1.0  # m, between places that are kept
NEAR = 1.5  # m, within which a place is known again
WEIGHT = 20.0  # bits of the map that one of the pose is worth: all of the map hangs on the pose
RECENT = 3  # places that count as still here, not as visited again


class PoseInformation:
    """Places with the variance, m^2, that the position had there when they were first seen.

    site  whose SLAM tells its covariance
    """

    def __init__(self, site: PatrolView):
        self._site = site
        self._places: list[tuple[float, float]] = []
        self._variances: list[float] = []
        self._variance = MATCH

    def follow(self, survey: PlanningSnapshot) -> None:
        """Take the variance from the SLAM; keep the place, if it is a new one."""
        here, position = survey.position, self._site.covariance[:2, :2]
        self._variance = MATCH + math.sqrt(max(float(np.linalg.det(position)), 0.0))
        if not self._places or min(math.dist(here, place) for place in self._places) >= SPACING:
            self._places.append(here)
            self._variances.append(self._variance)

    def places(self) -> Array:
        """(k, 2) m, those visited before."""
        return np.array(self._places[:-RECENT]).reshape(-1, 2)

    def bits(self, points: Array, lengths: Array) -> Array:
        """(n,) weighted bits: the change of the entropy of x and y, both Gaussian."""
        before = self._variance + DRIFT * lengths
        after = np.minimum(before, self._known(points) + MATCH)
        return WEIGHT * np.log2(before / after)

    def _known(self, points: Array) -> Array:
        """(n,) m^2, the least variance of earlier places near each of points (n, 2), m; or inf."""
        places, variances = self.places(), np.array(self._variances[:-RECENT])
        if not len(places):
            return np.full(len(points), np.inf)
        away = np.linalg.norm(points[:, None] - places[None], axis=2)
        return np.where(away < NEAR, variances, np.inf).min(axis=1)
