"""Static map: per cell the sum of all log-odds (Elfes 1989; Thrun, Burgard, Fox 2005, 9.2)."""

from __future__ import annotations

import numpy as np

from slam.errors import InputError
from slam.geometry import Pose2
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence
from slam.maps.rays import ObservedCells, Rays
from slam.scan import Scan

NO_DOUBT = np.float32(-16.0)  # log-odds of a cell that is free: below, h is not updated (2e-7)


class Static:
    """Assumes a static world: a cell observed a hundred times in one state needs as many to change.

    resolution  m, side of a cell
    limit       nats, log-odds (prior included) are clamped to +- this; finite in `Clamped`
    log_odds    layer, float32
    """

    def __init__(
        self,
        resolution: float = 0.05,
        evidence: Evidence = Evidence(),
        rays: Rays = Rays(),
        limit: float = np.inf,
    ):
        if not limit > 0:
            raise InputError(f"limit must be above 0 (it may be infinite), got {limit}")
        self.evidence = evidence
        self.limit = limit
        self.cells = Cells(resolution, evidence.prior, rays)
        self.log_odds = self.cells.tiles.layer(np.float32, evidence.prior_log_odds)

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Add the scan's evidence to the observed cells (equations 3 and 4)."""
        return self._add_evidence(scan, pose, at_once=True)

    def accumulate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """The same, but h of the cells that are returned is computed by `settle`: once for many
        scans. Until then `cells.occupied` is out of date, and the map must not be forked."""
        return self._add_evidence(scan, pose, at_once=False)

    def _add_evidence(self, scan: Scan, pose: Pose2, at_once: bool) -> np.ndarray:
        return _add(
            self.cells.trace(scan, pose),
            self.log_odds.flat,
            self.cells.occupied.flat,
            np.float32(self.evidence.hit),
            np.float32(self.evidence.free),
            np.float32(self.limit),
            at_once,
        )

    def settle(self, cells: np.ndarray) -> None:
        """Compute h of cells (n,)."""
        _settle(cells, self.log_odds.flat, self.cells.occupied.flat)


@kernel
def _add(observed: ObservedCells, log_odds, occupied, hit_evidence, free_evidence, limit, at_once):
    """Add the evidence; returns the cells whose h or centroid may have changed. If not `at_once`,
    h is computed only of those cells that `_settle` will leave as they are."""
    cells, hit = observed.cells, observed.hit
    changed, n = np.empty(len(cells), np.int64), 0
    for k in range(len(cells)):
        i = np.uint64(cells[k])  # unsigned: numba need not check the sign
        before = log_odds[i]
        sum_ = before + (hit_evidence if hit[k] else free_evidence)
        log_odds[i] = min(max(sum_, -limit), limit)
        if hit[k] or log_odds[i] > NO_DOUBT:
            if at_once or log_odds[i] <= NO_DOUBT:
                occupied[i] = _h(log_odds[i])
            changed[n] = cells[k]
            n += 1
        elif before > NO_DOUBT and not at_once:  # free without a doubt from now on: h stays
            occupied[i] = _h(before)
    return changed[:n]


@kernel
def _settle(cells, log_odds, occupied):
    """Compute h of cells, but of those that are free without a doubt."""
    for cell in cells:
        i = np.uint64(cell)
        if log_odds[i] > NO_DOUBT:
            occupied[i] = _h(log_odds[i])


@kernel
def _h(log_odds):
    one = np.float32(1.0)
    return one / (one + np.exp(-log_odds))
