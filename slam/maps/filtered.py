"""Filtered map: what moves is kept apart from what stays (Wolf and Sukhatme 2005)."""

from __future__ import annotations

import math

import numpy as np

from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence, probability
from slam.maps.rays import Rays
from slam.scan import Scan
from slam.validation import positive_number


class Filtered:
    """Two grids: of what stays, which the robot finds its way by, and of what moves.

    A hit where the static grid is surely free comes from something that moves: it goes to the
    dynamic grid, and into the static one as though the beam had passed (their table 1). So people
    leave nothing behind, and whatever was once away is not found the way by again: an open door
    that closes stays out of h for good, and with it what it says of where the robot is. Fox et al.
    (1999) filter by the expected distance instead, beam by beam. A filtered hit leaves a centroid,
    which nothing is matched with, since h is next to nothing there.

    resolution  m, side of a cell
    sure        P(occupied) of the static grid below which it is surely free
    limit       nats, the dynamic log-odds are clamped to +- this: what moves is soon elsewhere
    log_odds    layer, float32, static
    moving      layer, float32, log-odds of something that moves being there now
    """

    def __init__(
        self,
        resolution: float = 0.05,
        evidence: Evidence = Evidence(),
        rays: Rays = Rays(),
        sure: float = 0.01,
        limit: float = 2.0,
    ):
        if not 0 < sure < 1:
            raise InputError(f"sure must be above 0 and below 1, got {sure!r}")
        positive_number("limit", limit)
        self.evidence = evidence
        self.sure = sure
        self.limit = limit
        self.cells = Cells(resolution, evidence.prior, rays)
        self.log_odds = self.cells.tiles.layer(np.float32, evidence.prior_log_odds)
        start = max(-limit, min(limit, evidence.prior_log_odds))
        self.moving = self.cells.tiles.layer(np.float32, start)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the static grid or to the dynamic one."""
        seen = self.cells.see(scan, pose)
        _observe(
            seen.cells,
            seen.hit,
            self.log_odds.flat,
            self.moving.flat,
            self.cells.occupied.flat,
            self.evidence.hit,
            self.evidence.free,
            math.log(self.sure / (1 - self.sure)),
            self.limit,
        )
        return seen.cells

    def dynamic(self) -> OccupancyGrid:
        """The dynamic grid: where something that moves is now."""
        tiles = self.cells.tiles
        observed = tiles.dense(self.cells.observed)
        return OccupancyGrid(tiles.spec, probability(tiles.dense(self.moving)), observed)


@kernel
def _observe(cells, hit, log_odds, moving, occupied, hit_evidence, free_evidence, free, limit):
    for k in range(len(cells)):
        i = cells[k]
        moves = hit[k] and log_odds[i] < free
        moving[i] = min(max(moving[i] + (hit_evidence if moves else free_evidence), -limit), limit)
        log_odds[i] += hit_evidence if hit[k] and not moves else free_evidence
        occupied[i] = 1.0 / (1.0 + np.exp(-log_odds[i]))
