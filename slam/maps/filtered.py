"""Filtered map: moving objects are kept out of the static map (Wolf and Sukhatme 2005)."""

from __future__ import annotations

import math

import numpy as np

from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence, probability
from slam.maps.rays import ObservedCells, Rays
from slam.scan import Scan
from slam.validation import positive_number


class Filtered:
    """Two grids: a static one, which scans are matched with, and a dynamic one.

    A hit in a cell that the static grid holds free comes from a moving object: it is added to the
    dynamic grid, and to the static one as free (their table 1). So people leave no trace, but a
    door that was once open stays out of h permanently after it closes, and the information that it
    holds about the pose is lost. Fox et al. (1999) filter by the expected distance instead, beam by
    beam. A filtered hit still adds to the cell's centroid, which has no effect on matching, since h
    is close to zero there.

    resolution      m, side of a cell
    free_threshold  P(occupied) of the static grid below which a cell is held free
    limit           nats, the dynamic log-odds are clamped to +- this: moving objects soon leave
    log_odds        layer, float32, static
    moving          layer, float32, log-odds that a moving object is there now
    """

    def __init__(
        self,
        resolution: float = 0.05,
        evidence: Evidence = Evidence(),
        rays: Rays = Rays(),
        free_threshold: float = 0.01,
        limit: float = 2.0,
    ):
        if not 0 < free_threshold < 1:
            raise InputError(f"free_threshold must be above 0 and below 1, got {free_threshold!r}")
        positive_number("limit", limit)
        self.evidence = evidence
        self.free_threshold = free_threshold
        self.limit = limit
        self.cells = Cells(resolution, evidence.prior, rays)
        self.log_odds = self.cells.tiles.layer(np.float32, evidence.prior_log_odds)
        start = max(-limit, min(limit, evidence.prior_log_odds))
        self.moving = self.cells.tiles.layer(np.float32, start)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the static grid or to the dynamic one."""
        observed = self.cells.trace(scan, pose)
        _observe(
            observed,
            self.log_odds.flat,
            self.moving.flat,
            self.cells.occupied.flat,
            self.evidence.hit,
            self.evidence.free,
            math.log(self.free_threshold / (1 - self.free_threshold)),
            self.limit,
        )
        return observed.cells

    def dynamic(self) -> OccupancyGrid:
        """The dynamic grid: the probability that a moving object is in a cell now."""
        tiles = self.cells.tiles
        observed = tiles.dense(self.cells.observed)
        return OccupancyGrid(tiles.spec, probability(tiles.dense(self.moving)), observed)


@kernel
def _observe(
    observed: ObservedCells, log_odds, moving, occupied, hit_evidence, free_evidence, free, limit
):
    """Add the evidence; `free` and `limit` are log-odds, the threshold and the clamp."""
    cells, hit = observed.cells, observed.hit
    for k in range(len(cells)):
        i = cells[k]
        moves = hit[k] and log_odds[i] < free
        moving[i] = min(max(moving[i] + (hit_evidence if moves else free_evidence), -limit), limit)
        log_odds[i] += hit_evidence if hit[k] and not moves else free_evidence
        occupied[i] = 1.0 / (1.0 + np.exp(-log_odds[i]))
