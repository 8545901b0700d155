"""The inverse sensor model of an occupancy grid: the evidence of a hit and of a passing beam."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from slam.errors import InputError


@dataclass(frozen=True)
class Evidence:
    """The log-likelihood ratios log p(z|occupied) / p(z|free) of equation 3 (erratum 1), in nats.

    hit    of a beam that ends in the cell, > 0; by default one hit outweighs the prior
    free   of a beam that passes through, < 0
    prior  P(occupied) of a cell that was never observed
    """

    hit: float = 1.5
    free: float = -0.4
    prior: float = 0.2

    def __post_init__(self) -> None:
        if not (self.hit > 0 > self.free and 0 < self.prior < 1):
            raise InputError(f"Evidence needs hit > 0 > free and 0 < prior < 1, got {self}")

    @property
    def prior_log_odds(self) -> float:
        """The prior as log-odds."""
        return math.log(self.prior / (1 - self.prior))


def probability(log_odds: np.ndarray) -> np.ndarray:
    """Log-odds -> probability, any shape."""
    return expit(log_odds)
