"""How long a state lasts: the hazard of a change by the age of the state.

A door's states do not end at a constant rate: most last a minute, some a night. The hazard is the
share of the minutes watched at an age that were followed by a change (life table estimate; Cox and
Oakes 1984, section 4.2). A state whose begin or end was not seen counts for the minutes watched.
"""

from __future__ import annotations

import numpy as np

from slam.geometry import Array

AGES = np.array([0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768])
# min, the youngest age of each bin
PRIOR_MINUTES = 2.0  # weight of the state's mean hazard in the hazard of each age
MAX_AHEAD = 7 * 1440  # min


class DwellCounts:
    """Life table of both states.

    watched, ended  (2, 20) weighted minutes by state and age; `ended`: those followed by a change
    """

    def __init__(self) -> None:
        self.watched = np.zeros((2, len(AGES)))
        self.ended = np.zeros((2, len(AGES)))

    def add(self, state: np.ndarray, age: np.ndarray, ended: np.ndarray, weights: Array) -> None:
        """Count minutes (n,) of known age in min, followed by a minute that was watched too."""
        cell = state.astype(np.int64) * len(AGES) + age_bin(age)
        shape, size = self.watched.shape, self.watched.size
        self.watched += np.bincount(cell, weights, size).reshape(shape)
        self.ended += np.bincount(cell, weights * ended, size).reshape(shape)

    def hazards(self, scale: float) -> Array:
        """(2, 20) probability of a change within the next minute."""
        watched, ended = scale * self.watched, scale * self.ended
        mean = (ended.sum(1, keepdims=True) + 1.0) / (watched.sum(1, keepdims=True) + 60.0)
        return (ended + PRIOR_MINUTES * mean) / (watched + PRIOR_MINUTES)


def survival(hazards: Array, age: int, ahead: np.ndarray) -> Array:
    """P(no change within `ahead` min) of a state of `age` min; hazards (20,), ahead (n,)."""
    ages = age + np.arange(int(ahead.max(initial=0)))
    logs = np.log1p(-hazards[age_bin(ages)])
    return np.exp(np.concatenate([[0.0], np.cumsum(logs)])[ahead])


def age_bin(age: np.ndarray) -> np.ndarray:
    """Index of the bin of ages in min (n,)."""
    return np.searchsorted(AGES, age, side="right") - 1
