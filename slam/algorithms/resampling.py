"""Resampling of particles in proportion to their weights."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Array

BELOW_ONE = math.nextafter(1.0, 0.0)


def systematic(weights: Array, u: float) -> np.ndarray:
    """(n,) ancestor indices in ascending order: systematic resampling (Kitagawa 1996).

    weights (n,) sum to 1; u is one number, uniform in [0, 1). Particle i has n w_i descendants on
    average, and always fewer than one more or less than that.
    """
    n = len(weights)
    sums = np.cumsum(weights)
    sums /= sums[-1]
    places = np.minimum((np.arange(n) + u) / n, BELOW_ONE)  # the last may be rounded to 1
    return np.searchsorted(sums, places, side="right")


def effective(weights: Array) -> float:
    """Effective number of particles: 1 / sum w^2 (Liu 1996)."""
    return float(1.0 / np.square(weights).sum())


def normalised(log_weights: Array) -> Array:
    """Weights that sum to 1, from their unnormalised logarithms."""
    weights = np.exp(log_weights - log_weights.max())
    return weights / weights.sum()
