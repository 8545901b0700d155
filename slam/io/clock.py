"""Recorders' clocks run backwards and stand still; a trajectory's times may not."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from slam.geometry import Array

TICK = 1e-6  # s, the logs' own precision
LEAP = 10.0  # s: a stamp this far ahead of the next one is itself wrong


def steady(times: Array, joined: np.ndarray, warn: Callable[[int, str], None]) -> Array:
    """Times (n,) in file order made to increase, each by as little as it takes.

    A time that does not come after the one before it is moved to a tick after that. A single one
    that leaps ahead of the next is moved back instead, so that it does not push on all that follow.
    `joined` (n,) bool: this message is of the same moment as the one before it and keeps its time.
    `warn(at, kind)` is told of every move.
    """
    result = times.copy()
    last = -math.inf
    for k, time in enumerate(times.tolist()):
        if k and joined[k]:
            result[k] = last
            continue
        if _leaps(times, k, last):
            warn(k, "time stamp leaps ahead, moved back")
            time = last if math.isfinite(last) else float(times[k + 1]) - 2 * TICK
        elif time < last:
            warn(k, "time runs backwards, stamp moved forward")
        elif time == last:
            warn(k, "time stands still, stamp moved forward")
        last = time if time > last else max(last + TICK, math.nextafter(last, math.inf))
        result[k] = last
    return result


def _leaps(times: Array, k: int, last: float) -> bool:
    return k + 1 < len(times) and last <= times[k + 1] < times[k] - LEAP
