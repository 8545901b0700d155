"""Stand: stay where most doors are in sight, and look around."""

from __future__ import annotations

import numpy as np

from agents.viewpoints.situation import Situation
from slam.geometry import Array


class Stand:
    """The place that shows most doors, of equal ones the nearest; then it stays there.

    A doorway counts by what is not known of it once it was out of sight for long: bare ones do not.
    """

    def choose(self, situation: Situation) -> int:
        """See `ViewpointPolicy`."""
        shown = situation.around @ unsettled(situation)
        return int(np.lexsort((situation.times, -shown * np.isfinite(situation.times)))[0])


def unsettled(situation: Situation) -> Array:
    """(d,) expected squared error of each doorway, long after a look."""
    return np.round(situation.doors.fresh[:, -2], 2)
