"""Features of viewpoints, which the learned policy reads; the same in training and on the robot.

All come from the table and from the expected errors of the doorways (`DoorBelief`), which are
integrated over time as piecewise linear curves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from agents.viewpoints.situation import Situation
from agents.viewpoints.table import Bools
from dynslam_env.navigation.door_belief import HORIZONS
from slam.geometry import Array
from slam.kernel import kernel

END = 90.0  # s from now, up to which saved errors count, as in `Greedy`
AFTER = (0.0, 40.0, 160.0)  # s after the arrival, likewise, for the other rates
TIME_SCALE = 30.0  # s
AGE_SCALE = 60.0  # s
ERROR_SCALE = 4.0  # brings squared errors, at most 0.25, to 1
LATER = 5  # index into HORIZONS of the time at which an error counts as that of a forgotten door
RATES = 3  # saved errors per second, over the best viewpoint's: the first features
GREEDY, SHORT_SIGHTED, FAR_SIGHTED = 0, 1, 2  # of these, the one of `Greedy`, and those of AFTER
NEAR_TIME = 20.0  # s, over which what can be seen after a viewpoint counts less
FAR_TIME = 60.0  # s, at most, from a viewpoint to the sight of a doorway
DURATION = 600.0  # s, scale of the time since the episode began
EXPLORING, ELAPSED = 14, 20  # features: whether it is the row of exploring; time over DURATION
OWN, SHARED = 16, 8  # features of a viewpoint, and of the situation as a whole
FEATURES = OWN + SHARED


class Ahead(NamedTuple):
    """Where to drive from here, for v viewpoints and d doorways, the first `doors` of them real.

    times     (v,) s; inf: cannot be reached
    sees      (v, d) whether a doorway is seen on that way or there
    reach     (v, d) s from a viewpoint until a doorway is seen
    doors     number of doorways
    last      the viewpoint where the robot is; -1 at none
    time      s since the episode began
    frontier  s to where exploring leads; inf: nowhere
    """

    times: Array
    sees: Bools
    reach: Array
    doors: int
    last: int
    time: float
    frontier: float


class Expected(NamedTuple):
    """Expected squared errors of d doorways; see `DoorBelief`.

    age    (d,) s
    leaf   (d,) whether a leaf was seen
    stale  (d, HORIZONS)
    fresh  (d, HORIZONS)
    """

    age: Array
    leaf: Bools
    stale: Array
    fresh: Array


def features(situation: Situation) -> Array:
    """(v + 1, FEATURES) of the viewpoints of a situation, and of exploring."""
    doors = situation.doors
    found = np.zeros((len(situation.times) + 1, FEATURES))
    ahead = Ahead(
        situation.times, situation.sees, situation.reach, len(doors.age), situation.last,
        situation.time, situation.frontier,
    )  # fmt: skip
    describe(ahead, Expected(doors.age, doors.leaf, doors.stale, doors.fresh), found)
    return found


@kernel
def _sums(errors, count):
    """(d, HORIZONS) s, the integrals of `errors` up to each of HORIZONS."""
    sums = np.zeros_like(errors)
    for d in range(count):
        for k in range(1, len(HORIZONS)):
            step = HORIZONS[k] - HORIZONS[k - 1]
            sums[d, k] = sums[d, k - 1] + 0.5 * step * (errors[d, k] + errors[d, k - 1])
    return sums


@kernel
def _up_to(errors, sums, time):
    """s, the integral of one door's errors up to `time`."""
    k = 0
    while k < len(HORIZONS) - 2 and HORIZONS[k + 1] <= time:
        k += 1
    gone = time - HORIZONS[k]
    slope = (errors[k + 1] - errors[k]) / (HORIZONS[k + 1] - HORIZONS[k])
    if gone > HORIZONS[k + 1] - HORIZONS[k]:
        slope = 0.0
    return sums[k] + gone * (errors[k] + 0.5 * slope * gone)


@kernel
def describe(ahead: Ahead, expected: Expected, found):
    """Write the features (v + 1, FEATURES), the last row that of exploring; rows of what cannot be
    reached are 0."""
    n, stale, fresh, leaves = ahead.doors, expected.stale, expected.fresh, 0
    stales, freshes = _sums(stale, n), _sums(fresh, n)
    total, later, nearest = 1e-6, 0.0, 10.0 * TIME_SCALE
    tops = np.full(RATES, 1e-6)
    found[:] = 0.0
    for d in range(n):
        total += stale[d, 0]
        later += fresh[d, LATER]
        leaves += expected.leaf[d]
    for i in range(len(ahead.times)):
        time, row = ahead.times[i], found[i]
        if not np.isfinite(time):
            continue
        nearest = min(nearest, time)
        for d in range(n):
            reach = ahead.reach[i, d]
            row[12] += fresh[d, LATER] * min(reach / FAR_TIME, 1.0) / max(later, 1e-6)
            if not ahead.sees[i, d]:
                row[13] += ERROR_SCALE * stale[d, 0] * np.exp(-reach / NEAR_TIME)
                continue
            now = _up_to(stale[d], stales[d], time)
            for k in range(RATES):
                after = max(END - time, 0.0) if k == GREEDY else AFTER[k]
                row[k] += _up_to(stale[d], stales[d], time + after) - now
                row[k] -= _up_to(fresh[d], freshes[d], after)
            row[3] += stale[d, 0]
            row[5] += ERROR_SCALE * fresh[d, LATER]
            row[6] = max(row[6], ERROR_SCALE * stale[d, 0])
            forgotten = (1.0 - np.exp(-expected.age[d] / AGE_SCALE)) / 4.0
            row[7] += forgotten
            row[15] += 0.0 if expected.leaf[d] else forgotten
            row[8] += 0.25
        row[4] = ERROR_SCALE * row[3]
        row[3] /= total
        row[9], row[10] = min(time / TIME_SCALE, 4.0), 3.0 / time
        row[11] = 1.0 if i == ahead.last else 0.0
        for k in range(RATES):
            row[k] /= time
            tops[k] = max(tops[k], row[k])
    exploring = found[len(ahead.times)]
    if np.isfinite(ahead.frontier):
        exploring[9], exploring[10] = min(ahead.frontier / TIME_SCALE, 4.0), 3.0 / ahead.frontier
        exploring[EXPLORING] = 1.0
    for i in range(len(found)):
        if found[i, 9] > 0.0:
            found[i, :RATES] /= tops
            found[i, OWN] = total
            found[i, OWN + 1] = later
            found[i, OWN + 2] = tops[0] / max(total, 0.05)
            found[i, OWN + 3] = nearest / TIME_SCALE
            found[i, ELAPSED] = ahead.time / DURATION
            found[i, OWN + 5] = 0.1 * n
            found[i, OWN + 6] = 0.2 * leaves
            found[i, OWN + 7] = min(ahead.frontier / TIME_SCALE, 4.0)
