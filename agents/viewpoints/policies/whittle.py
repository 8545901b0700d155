"""Whittle: doorways as restless bandits with restarts, chosen by Whittle's index per second."""

from __future__ import annotations

import numpy as np

from agents.viewpoints.situation import GRID, Situation, at
from slam.geometry import Array


class Whittle:
    """The sum of the indices of the doorways that a viewpoint shows, over the time it takes.

    Restless bandits with controlled restarts (Akbarzadeh and Mahajan 2021): a look restarts a
    door's error. With the error u(a) at the age a, the index is the price of a look at which
    looking at the ages a and a + da cost the same on average: a u(a) minus the integral of u.
    """

    def choose(self, situation: Situation) -> int:
        """See `ViewpointPolicy`."""
        value = (situation.sees * indices(situation)).sum(axis=1) / situation.times
        value[~np.isfinite(situation.times)] = -np.inf
        return int(np.argmax(value))


def indices(situation: Situation) -> Array:
    """(d,) s, Whittle's index of each doorway at its age."""
    ages = np.minimum(situation.doors.age, GRID[-1])
    error = situation.doors.closed * (1.0 - situation.doors.closed)
    return ages * error - at(situation.fresh, ages[None])[0]
