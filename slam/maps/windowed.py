"""Base of the maps that cut time into windows: parameters, cells and the numbers of the windows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import logit

from slam.geometry import Array
from slam.kernel import kernel
from slam.maps.cells import Cells
from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays
from slam.maps.tiles import Tiles
from slam.validation import positive_number, whole_number

NO_WINDOW = np.iinfo(np.int32).min  # window number of a cell that was never observed
MAX_WINDOWS = 255  # closed windows counted per cell, uint8: of 4 s each, 17 minutes of observation


class WindowParameters(NamedTuple):
    """The parameters of a `Windowed` map, as its kernel takes them.

    limits  (bins - 1,) `bin_limits`
    hit     nats, evidence of a beam that ends in the cell
    free    nats, evidence of a beam that passes through the cell
    start   nats, log-odds at the start of a window
    weight  a, the prior's weight in windows
    prior   P(occupied) of a cell that was never observed
    """

    limits: Array
    hit: float
    free: float
    start: float
    weight: float
    prior: float


def bin_limits(bins: int) -> Array:
    """(bins - 1,) the log-odds that separate `bins` bins of equal width in probability."""
    return logit(np.arange(1, bins) / bins)


@kernel
def bin_of(log_odds, limits):
    """The bin that log-odds fall into. A linear search: most observed cells are free, in bin 0."""
    b = 0
    while b < len(limits) and log_odds >= limits[b]:
        b += 1
    return b


class WindowClock:
    """Numbers the windows of `delta_t` s, from 0 at the first time that is passed to `at`."""

    def __init__(self, delta_t: float):
        positive_number("delta_t", delta_t)
        self._delta_t = delta_t
        self._start: float | None = None

    def at(self, time: float) -> int:
        """Number of the window that `time` (s) lies in; negative before the first time."""
        if self._start is None:
            self._start = time
        return int((time - self._start) // self._delta_t)


class Windowed:
    """Base of maps that accumulate log-odds per window and count the windows' occupancy in bins.

    resolution  m, side of a cell
    delta_t     s, length of a window
    bins        B, number of bins that the occupancy of a window is rounded to for h
    weight      a, the prior's weight in windows
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
        self._parameters = WindowParameters(
            bin_limits(bins),
            evidence.hit,
            evidence.free,
            evidence.prior_log_odds,
            weight,
            evidence.prior,
        )
        self._clock = WindowClock(delta_t)
        self._add_layers(self.cells.tiles)

    def _add_layers(self, tiles: Tiles) -> None:
        """Add the map's own layers to `tiles`."""
        raise NotImplementedError
