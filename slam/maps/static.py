"""Static map: per cell the sum of all log-odds (Elfes 1989; Thrun, Burgard, Fox 2005, 9.2)."""

from __future__ import annotations

import numpy as np

from slam.checked import positive_number
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import GridSpec, grown
from slam.maps.centroids import Centroids
from slam.maps.log_odds import Evidence, probability
from slam.maps.rays import Rays, covering, trace
from slam.scan import Scan


class Static:
    """Believes that the world never changes: seen a hundred times takes as long to unlearn.

    resolution  m, side of a cell
    limit       nats, log-odds (prior included) are clamped to +- this; finite in `Clamped`
    """

    def __init__(
        self,
        resolution: float = 0.05,
        evidence: Evidence = Evidence(),
        rays: Rays = Rays(),
        limit: float = np.inf,
    ):
        positive_number("resolution", resolution)
        if not limit > 0:
            raise InputError(f"limit must be above 0 (it may be infinite), got {limit}")
        self.evidence = evidence
        self.rays = rays
        self.prior = evidence.prior
        self.limit = limit
        self.resolution = resolution
        self.spec = GridSpec(resolution, 0, 0, 0, 0)
        self.log_odds = np.zeros(self.spec.shape, np.float32)
        self.occupied = np.zeros(self.spec.shape, np.float32)
        self.observed = np.zeros(self.spec.shape, np.bool_)
        self.centroids = Centroids(self.spec)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the cells that it saw (equations 3 and 4)."""
        sensor, ends, hit = self.rays.ends(scan, pose)
        self._grow(covering(self.spec, sensor, ends))
        seen = trace(self.spec, sensor, ends, hit)
        log_odds = self.log_odds.reshape(-1)
        evidence = np.where(seen.hit, self.evidence.hit, self.evidence.free)
        updated = np.clip(log_odds[seen.cells] + evidence, -self.limit, self.limit)
        log_odds[seen.cells] = updated
        self.occupied.reshape(-1)[seen.cells] = probability(updated)
        self.observed.reshape(-1)[seen.cells] = True
        self.centroids.add(self.spec, ends[hit])
        return seen.cells

    def _grow(self, spec: GridSpec) -> None:
        if spec == self.spec:
            return
        self.log_odds = grown(self.log_odds, self.spec, spec, self.evidence.prior_log_odds)
        self.occupied = grown(self.occupied, self.spec, spec, self.prior)
        self.observed = grown(self.observed, self.spec, spec, False)
        self.centroids.grow(self.spec, spec)
        self.spec = spec
