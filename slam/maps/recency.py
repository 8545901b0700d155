"""Recency map: evidence decays over several time scales at once (Biber and Duckett 2005)."""

from __future__ import annotations

import math

import numpy as np

from slam.errors import InputError
from slam.geometry import Pose2
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence
from slam.maps.rays import ObservedCells, Rays
from slam.maps.tiles import AREA
from slam.scan import Scan
from slam.validation import positive_number


class Recency:
    """Averages over several time scales: the short ones follow changes, the long ones keep walls.

    Per scale tau a cell's log-odds are the prior's plus those of all observations, each weighted by
    exp(-age / tau). h is the mean over the scales of the probabilities. The paper keeps samples of
    echoes, replaces a share of them at each update, and estimates by robust statistics; here the
    share follows from the elapsed time, and the sigmoid bounds the influence of a single scale.

    If it is observed often, a cell that was occupied for long becomes free at a scale after
    tau log(1 + hit / -free), prior aside; a free one becomes occupied after
    tau log(1 + -free / hit). h of an unobserved cell stays as it was: evidence decays at the next
    observation.

    resolution  m, side of a cell
    scales      s, tau of each; infinity never forgets: alone, it is the static map
    log_odds    layer of (scales,) float32, without the prior
    last        layer, float32, s from the first scan to the last observation of the cell
    """

    def __init__(
        self,
        resolution: float = 0.05,
        evidence: Evidence = Evidence(),
        rays: Rays = Rays(),
        scales: tuple[float, ...] = (2.0, 40.0, 800.0),
    ):
        if not scales:
            raise InputError("scales must hold at least one time scale, got none")
        for scale in scales:
            if scale != math.inf:
                positive_number("each of scales", scale)
        self.evidence = evidence
        self.scales = scales
        self.cells = Cells(resolution, evidence.prior, rays)
        tiles = self.cells.tiles
        self.log_odds = tiles.layer(np.float32, 0, (AREA, len(scales)))
        self.last = tiles.layer(np.float32)
        self._rates = 1 / np.array(scales)
        self._start: float | None = None

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Decay the log-odds of the observed cells and add the scan's evidence."""
        observed = self.cells.trace(scan, pose)
        if self._start is None:
            self._start = scan.time
        _observe(
            observed,
            scan.time - self._start,
            self._rates,
            self.log_odds.flat,
            self.last.flat,
            self.cells.occupied.flat,
            np.float32(self.evidence.hit),
            np.float32(self.evidence.free),
            np.float32(self.evidence.prior_log_odds),
        )
        return observed.cells


@kernel
def _observe(
    observed: ObservedCells, now, rates, log_odds, last, occupied, hit_evidence, free_evidence,
    prior,
):  # fmt: skip
    """Decay by the time since each cell's last observation, add the evidence, update h."""
    cells, hit = observed.cells, observed.hit
    scales, one = len(rates), np.float32(1.0)
    # Most cells of a scan were last observed at the same time: the decay is computed once for them.
    decay, after = np.ones(scales, np.float32), 0.0
    for k in range(len(cells)):
        i = cells[k]
        gone = max(now - last[i], 0.0)
        last[i] = now
        if gone != after:
            for s in range(scales):
                decay[s] = np.exp(-gone * rates[s])
            after = gone
        h = np.float32(0.0)
        for s in range(scales):
            log_odds[i, s] = log_odds[i, s] * decay[s] + (hit_evidence if hit[k] else free_evidence)
            h += one / (one + np.exp(-(prior + log_odds[i, s])))
        occupied[i] = h / scales
