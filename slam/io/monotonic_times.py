"""Make the times of a log increase, as those of a trajectory must."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from slam.geometry import Array

TICK = 1e-6  # s, the precision of the logs
MAX_STEP = 10.0  # s: a stamp farther ahead of the next ones is wrong; farther behind, the clock is
MAX_STEP_BACK = 1.0  # s: real logs step back by less (Intel's recording: up to 0.9 s)
LOOK_AHEAD = 5  # stamps that tell a wrong one from a gap; half of them may be wrong too


def monotonic(times: Array, joined: np.ndarray, warn: Callable[[int, str], None]) -> Array:
    """Times (n,) in file order, changed as little as needed to increase.

    A time that does not come after the one before it is moved to a tick after that. One or two that
    are far ahead of those that follow are moved back instead, so that the rest need not be moved.
    Where the clock was set back by more than `MAX_STEP` and goes on from there, its times are
    shifted to go on from the last one at the log's usual step, and keep their differences, until
    the clock is right again. `joined` (n,) bool: this message is of the same moment as the one
    before it and keeps its time. `warn(at, kind)` is called for every move, once for a whole shift.
    """
    new = ~joined
    new[:1] = True
    first = np.flatnonzero(new).tolist()
    moments = times[new]
    usual = _usual_step(moments)
    result = np.empty_like(moments)
    last, shift = -math.inf, 0.0
    for k, own in enumerate(moments.tolist()):
        time = own + shift
        following = (moments[k + 1 : k + 1 + LOOK_AHEAD] + shift).tolist()
        if _leaps(time, following, last):
            warn(first[k], "time stamp leaps ahead, moved back")
            time = last if math.isfinite(last) else min(following) - (LOOK_AHEAD + 1) * TICK
        else:
            if shift and own > last - MAX_STEP_BACK:
                time, shift = own, 0.0
            elif time < last - MAX_STEP and following and following[0] <= last:
                warn(first[k], "clock set back, its times shifted from there on")
                shift = last + usual - own
                time = own + shift
            if time < last:
                warn(first[k], "time runs backwards, stamp moved forward")
            elif time == last:
                warn(first[k], "time stands still, stamp moved forward")
        last = time if time > last else max(last + TICK, math.nextafter(last, math.inf))
        result[k] = last
    return result[np.cumsum(new) - 1]


def _leaps(time: float, following: list[float], last: float) -> bool:
    """Whether at least half of the following times lie well before this one, but after the last."""
    back = sum(last <= other < time - MAX_STEP for other in following)
    return back > 0 and 2 * back >= len(following)


def _usual_step(moments: Array) -> float:
    steps = np.diff(moments)
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else TICK
