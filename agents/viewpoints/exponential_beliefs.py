"""ExponentialBeliefs: beliefs about many doors at once, by memoryless laws in closed form.

The fast setting's stand-in for `DwellLaws`: a grid of two-state Markov chains, and doors that never
flip. Each door has its own weights of the laws, by the likelihood of its looks.
"""

from __future__ import annotations

import numpy as np

from agents.viewpoints.situation import DoorRows
from dynslam_env.navigation.door_belief import HORIZONS, spread
from dynslam_env.patrol.dwell_laws import LOOK_ERROR, TRUST
from slam.geometry import Array

MEANS = np.array([40.0, 80.0, 160.0, 320.0])  # s, mean times open and closed of the laws
STILL_SHARE = 0.2  # prior weight of the law that a door never flips
STILL_RATE = 1e-6  # 1/s


class ExponentialBeliefs:
    """n x d doors.

    weights  (n, d, h) of the laws
    closed_  (n, d, h) P(closed at the last update) by each law
    age      (n, d) s since the last look; inf before
    """

    def __init__(self, n: int, d: int):
        a, b = (1.0 / rows.ravel() for rows in np.meshgrid(MEANS, MEANS))
        self._rate = np.append(a + b, STILL_RATE)  # 1/s, at which a law forgets
        self._share = np.append(a / (a + b), 0.5)  # of the time closed
        count = len(a)
        self._prior = np.append(np.full(count, (1.0 - STILL_SHARE) / count), STILL_SHARE)
        self._decay = np.exp(-self._rate[:, None] * HORIZONS)  # (h, HORIZONS)
        self.weights = np.empty((n, d, count + 1))
        self.closed_, self.age = np.empty_like(self.weights), np.empty((n, d))
        self.reset(np.arange(n))

    def reset(self, rows: np.ndarray) -> None:
        """Forget all doors of some rows."""
        self.weights[rows], self.closed_[rows], self.age[rows] = self._prior, self._share, np.inf

    def closed(self, ahead: Array | float = 0.0) -> Array:
        """(n, d) P(closed) `ahead` (n,) s from now, without a look."""
        gone = np.exp(-np.multiply.outer(np.broadcast_to(ahead, len(self.age)), self._rate))
        p = self._share + (self.closed_ - self._share) * gone[:, None]
        return (self.weights * p).sum(axis=-1)

    def advance(self, seconds: Array) -> None:
        """Let `seconds` (n,) pass."""
        gone = np.exp(-np.multiply.outer(seconds, self._rate))[:, None]
        self.closed_ = self._share + (self.closed_ - self._share) * gone
        self.age += seconds[:, None]

    def look(self, seen: np.ndarray, is_closed: np.ndarray) -> None:
        """Add looks at the doors `seen` (n, d), which are in the state `is_closed` (n, d)."""
        weights = self._after_look(np.where(is_closed[..., None], self.closed_, 1.0 - self.closed_))
        certain = np.where(is_closed, 1.0 - LOOK_ERROR, LOOK_ERROR)[..., None]
        self.weights = np.where(seen[..., None], weights, self.weights)
        self.closed_ = np.where(seen[..., None], certain, self.closed_)
        self.age = np.where(seen, 0.0, self.age)

    def rows(self) -> DoorRows:
        """The beliefs (n, d, ...) as policies read them."""
        mixed = self.weights @ self._share
        later = mixed[..., None] + (self.weights * (self.closed_ - self._share)) @ self._decay
        closed, fresh = later[..., 0], np.zeros_like(later)
        for state in (0.0, 1.0):
            weights = self._after_look(self.closed_ if state else 1.0 - self.closed_)
            shares = (weights @ self._share)[..., None]
            after = shares + (weights * (state - self._share)) @ self._decay
            fresh += (closed if state else 1.0 - closed)[..., None] * spread(after)
        return DoorRows(closed, self.age, spread(later), fresh)

    def _after_look(self, p: Array) -> Array:
        """(n, d, h) the weights after a look at a state that has P `p` (n, d, h) by each law."""
        weights = self.weights * np.maximum(p, LOOK_ERROR) ** TRUST
        return weights / weights.sum(axis=-1, keepdims=True)
