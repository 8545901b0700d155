"""Greedy: the viewpoint that saves most expected error per second."""

from __future__ import annotations

import numpy as np

from agents.viewpoints.situation import Situation, at
from slam.geometry import Array

HORIZON = 90.0  # s from now, up to which errors count


class Greedy:
    """Saved error of the doorways that the way and the viewpoint show, over the time it takes."""

    def choose(self, situation: Situation) -> int:
        """See `ViewpointPolicy`."""
        return int(np.argmax(rates(situation)))


def rates(situation: Situation) -> Array:
    """(..., v) error saved up to HORIZON by driving to each viewpoint, per second; -inf where it
    cannot be reached."""
    reached = np.isfinite(situation.times)
    times = np.where(reached, situation.times, HORIZON)
    when = np.broadcast_to(np.minimum(times, HORIZON)[..., None], situation.sees.shape)
    without = at(situation.stale, np.full_like(when, HORIZON)) - at(situation.stale, when)
    saved = without - at(situation.fresh, HORIZON - when)
    return np.where(reached, (saved * situation.sees).sum(axis=-1) / times, -np.inf)
