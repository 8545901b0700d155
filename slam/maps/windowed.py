"""What all maps that cut time into windows have: their parameters, their cells, their clock."""

from __future__ import annotations

from slam.checked import positive_number, whole_number
from slam.maps.bins import bin_limits
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays
from slam.maps.windows import Windows
from slam.tiles import Tiles


class Windowed:
    """Windows of `delta_t`, in which a cell gathers log-odds, and whose occupancy is counted in
    bins.

    resolution  m, side of a cell
    delta_t     s, length of a window
    bins        B, to which the occupancy of a window is rounded for h
    weight      a, how many windows the prior is worth
    """

    def __init__(
        self,
        resolution: float = 0.05,
        evidence: Evidence = Evidence(),
        rays: Rays = Rays(),
        delta_t: float = 4.0,
        bins: int = 10,
        weight: float = 0.1,
    ):
        positive_number("weight", weight)
        whole_number("bins", bins, 2)
        self.evidence = evidence
        self.delta_t = delta_t
        self.bins = bins
        self.weight = weight
        self.cells = Cells(resolution, evidence.prior, rays)
        self._limits = bin_limits(bins)
        self._windows = Windows(delta_t)
        self._begin(self.cells.tiles)

    def _begin(self, tiles: Tiles) -> None:
        """Take the layers."""
        raise NotImplementedError
