"""Recency map: what was seen fades, at several rates at once (Biber and Duckett 2005)."""

from __future__ import annotations

import math

import numpy as np

from slam.errors import InputError
from slam.geometry import Pose2
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays
from slam.maps.tiles import AREA
from slam.scan import Scan
from slam.validation import positive_number


class Recency:
    """Remembers over several time scales at once: some follow what moves, some keep what stays.

    Per scale tau a cell's log-odds are the prior's and those of all that was seen, each weighted by
    exp(-age / tau), whatever the gaps between. h is the mean over the scales of the probabilities.
    The paper keeps samples of echoes, of which it loses a share at each update, and has robust
    statistics say what they mean: here the share follows from the time gone by, and the sigmoid
    keeps a scale that is very sure from outvoting the others.

    A cell that was occupied for long is free to a scale after tau log(1 + hit / -free), prior
    aside, if it is seen often; one that was free is occupied after tau log(1 + -free / hit).
    While a cell is not seen, its h stays as it was: ages count when it is seen again.

    resolution  m, side of a cell
    scales      s, tau of each; infinity never forgets: alone, it is the static map
    log_odds    layer of (scales,) float32, the prior not counted in
    last        layer, float32, s since the first scan: when the cell was last seen
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
        """Let fade what the scan's cells were, and add what they are."""
        seen = self.cells.see(scan, pose)
        if self._start is None:
            self._start = scan.time
        _observe(
            seen.cells,
            seen.hit,
            scan.time - self._start,
            self._rates,
            self.log_odds.flat,
            self.last.flat,
            self.cells.occupied.flat,
            self.evidence.hit,
            self.evidence.free,
            self.evidence.prior_log_odds,
        )
        return seen.cells


@kernel
def _observe(
    cells, hit, now, rates, log_odds, last, occupied, hit_evidence, free_evidence, prior
):  # fmt: skip
    """Fade by the time since each cell was seen, add the evidence, and give h."""
    scales = len(rates)
    left, after = np.ones(scales), 0.0  # of what was seen: the same for most cells of a scan
    for k in range(len(cells)):
        i = cells[k]
        gone = max(now - last[i], 0.0)
        last[i] = now
        if gone != after:
            left, after = np.exp(-gone * rates), gone
        h = 0.0
        for s in range(scales):
            log_odds[i, s] = log_odds[i, s] * left[s] + (hit_evidence if hit[k] else free_evidence)
            h += 1.0 / (1.0 + np.exp(-(prior + log_odds[i, s])))
        occupied[i] = h / scales
