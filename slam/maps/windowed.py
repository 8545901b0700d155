"""What all maps that cut time into windows have: their parameters, their cells, their clock."""

from __future__ import annotations

import numpy as np
from scipy.special import logit

from slam.geometry import Array
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays
from slam.maps.tiles import Tiles
from slam.validation import positive_number, whole_number


def bin_limits(bins: int) -> Array:
    """(bins - 1,) the log-odds at which each bin ends and the next begins; all are equally wide in
    probability."""
    return logit(np.arange(1, bins) / bins)


@kernel
def bin_of(log_odds, limits):
    """The bin that log-odds fall into: few comparisons, since most of what is seen is free."""
    b = 0
    while b < len(limits) and log_odds >= limits[b]:
        b += 1
    return b


class Windows:
    """Windows of `delta_t` s, numbered from the first time that is asked for."""

    def __init__(self, delta_t: float):
        positive_number("delta_t", delta_t)
        self._delta_t = delta_t
        self._start: float | None = None

    def at(self, time: float) -> int:
        """Number of the window of `time`, s; below zero where the clock runs back."""
        if self._start is None:
            self._start = time
        return int((time - self._start) // self._delta_t)


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
