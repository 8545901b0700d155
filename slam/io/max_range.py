"""The maximum range of a laser, where its log does not give it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slam.geometry import Array

# m: the largest readings of a SICK LMS are codes, 8183 to 8191 of its units of 1 cm or 1 mm.
SICK_LMS_CM = 81.83
SICK_LMS_MM = (8.18, 8.192)
# The largest reading means "no echo" where as many readings are equal to it as:
MIN_SHARE = 1e-3  # of all readings, and
MIN_COUNT = 10  # and
MIN_RATIO = 5  # times as many as the second largest, or as lie in the
WINDOW = 0.1  # m below the largest


def estimated_max_range(ranges: Sequence[Array]) -> float:
    """The sensor's maximum range, m: its largest reading if that is frequent, at most 81.83 m.

    A sensor without an echo repeats one number, its largest. The largest reading therefore means
    "no echo" where it is far more frequent than those just below it; those of a far wall vary.
    Readings beyond 81.83 m, and beyond 8.18 m in a log that ends at 8.19 m, are SICK's codes.
    """
    readings = np.concatenate(ranges) if len(ranges) else np.empty(0)
    readings = readings[np.isfinite(readings) & (readings > 0)]
    if not len(readings):
        return SICK_LMS_CM
    top = float(readings.max())
    if SICK_LMS_MM[0] <= top <= SICK_LMS_MM[1]:
        return SICK_LMS_MM[0]
    return top if top < SICK_LMS_CM and _piles_up(readings, top) else SICK_LMS_CM


def _piles_up(readings: Array, top: float) -> bool:
    below = readings[readings < top]
    if not len(below):
        return False
    pile = len(readings) - len(below)
    near = max(int((below > top - WINDOW).sum()), int((below == below.max()).sum()))
    return pile >= max(MIN_COUNT, MIN_SHARE * len(readings), MIN_RATIO * near)
