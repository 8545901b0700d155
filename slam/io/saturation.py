"""From which reading on a range sensor means "no echo", where its log does not say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slam.geometry import Array

# m: the largest readings of a SICK LMS are codes, 8183 to 8191 of its units of 1 cm or 1 mm.
SICK_LMS_CM = 81.83
SICK_LMS_MM = (8.18, 8.192)
SHARE = 1e-3  # of all readings must be the largest one exactly, and
AT_LEAST = 10  # as many, and
TIMES = 5  # times as many as are the second largest, or lie in the
BELOW = 0.1  # m below the largest


def guessed_max_range(ranges: Sequence[Array]) -> float:
    """The sensor's maximum range, m: where its readings pile up, at 81.83 m at the latest.

    A sensor without an echo repeats one number, its largest. So the largest reading is taken for
    "no echo" where it is far more frequent than those just below it; a far wall spreads. Nothing
    beyond 81.83 m, and beyond 8.18 m in a log that ends at 8.19 m, is a distance: SICK's codes.
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
    near = max(int((below > top - BELOW).sum()), int((below == below.max()).sum()))
    return pile >= max(AT_LEAST, SHARE * len(readings), TIMES * near)
