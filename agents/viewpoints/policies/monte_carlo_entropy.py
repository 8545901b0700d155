"""Monte-Carlo entropy: viewpoints are drawn with the probability of their expected information."""

from __future__ import annotations

import numpy as np

from agents.viewpoints.situation import Situation


class MonteCarloEntropy:
    """Draws the next viewpoint with the probability of the entropy of the doorways it shows.

    After the Monte-Carlo strategy of Santos, Krajnik, Pulido Fentanes and Duckett (2016), with the
    beliefs about doors in the place of their maps of frequencies.

    rng  of the draws
    """

    def __init__(self, rng: np.random.Generator):
        self._rng = rng

    def choose(self, situation: Situation) -> int:
        """See `ViewpointPolicy`."""
        p = np.clip(situation.doors.closed, 1e-6, 1 - 1e-6)
        bits = -(p * np.log2(p) + (1 - p) * np.log2(1 - p))
        weights = (situation.around @ bits + 1e-9) * np.isfinite(situation.times)
        return int(self._rng.choice(len(weights), p=weights / weights.sum()))
