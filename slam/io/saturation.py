"""From which reading on a range sensor means "no echo", where its log does not say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slam.geometry import Array

SICK_LMS_CODES = (
    81.83  # m: the largest readings of a SICK LMS in cm mode, 81.83 to 81.91, are codes
)
SHARE = 1e-3  # of all readings must be the largest one exactly, and
AT_LEAST = 10  # as many, and
TIMES = 5  # times as many as lie in the
BELOW = 0.1  # m below it


def guessed_max_range(ranges: Sequence[Array]) -> float:
    """The sensor's maximum range, m: where its readings pile up, at 81.83 m at the latest.

    A sensor without an echo repeats one number, its largest. So the largest reading is taken for
    "no echo" where it is far more frequent than those just below it; a far wall spreads.
    """
    readings = np.concatenate(ranges) if len(ranges) else np.empty(0)
    readings = readings[np.isfinite(readings)]
    if not len(readings):
        return SICK_LMS_CODES
    top = float(readings.max())
    pile = int((readings == top).sum())
    near = int(((readings > top - BELOW) & (readings < top)).sum())
    saturated = pile >= max(AT_LEAST, SHARE * len(readings), TIMES * near) and top > 0
    return min(top, SICK_LMS_CODES) if saturated else SICK_LMS_CODES
