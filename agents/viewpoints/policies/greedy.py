"""Greedy: the viewpoint that saves most expected error per second."""

from __future__ import annotations

import numpy as np

from agents.viewpoints.situation import GRID, Situation, at
from slam.geometry import Array

HORIZON = 90.0  # s from now, up to which errors count


class Greedy:
    """Saved error of the doorways that the way and the viewpoint show, over the time it takes."""

    def choose(self, situation: Situation) -> int:
        """See `ViewpointPolicy`."""
        value = (savings(situation) * situation.sees).sum(axis=1) / situation.times
        value[~np.isfinite(situation.times)] = -np.inf
        return int(np.argmax(value))


def savings(situation: Situation) -> Array:
    """(v, d) s, error saved up to HORIZON by a look at each doorway on arrival at a viewpoint."""
    times = np.minimum(np.where(np.isfinite(situation.times), situation.times, GRID[-1]), HORIZON)
    when = np.repeat(times[:, None], situation.sees.shape[1], axis=1)
    without = at(situation.stale, np.full_like(when, HORIZON)) - at(situation.stale, when)
    return without - at(situation.fresh, HORIZON - when)
