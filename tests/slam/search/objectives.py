"""Smooth synthetic objectives whose maxima are known."""

from __future__ import annotations

import numpy as np

from slam.geometry import between

WIDTH = np.array([0.05, 0.05, 0.05])  # m, m, rad


def exponent(poses, peak, width=WIDTH):
    errors = between(peak, poses) / width
    return -0.5 * (errors**2).sum(axis=-1)


def one_peak(peak):
    """The log of one Gaussian."""
    return lambda poses: exponent(poses, peak)


def two_peaks(low, high):
    """The log of two narrow Gaussians, one a tenth of the other."""
    narrow = WIDTH * 0.4

    def objective(poses):
        a, b = exponent(poses, low, narrow), exponent(poses, high, narrow)
        return np.logaddexp(a + np.log(0.1), b)

    return objective
