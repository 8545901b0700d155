"""Bins of a histogram of occupancy: 0 is surely free, the last surely occupied."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.special import logit

from slam.geometry import Array


def bin_limits(bins: int) -> Array:
    """(bins - 1,) the log-odds at which each bin ends and the next begins; all are equally wide in
    probability."""
    return logit(np.arange(1, bins) / bins)


@njit(cache=True)
def bin_of(log_odds, limits):
    """The bin that log-odds fall into: few comparisons, since most of what is seen is free."""
    b = 0
    while b < len(limits) and log_odds >= limits[b]:
        b += 1
    return b
