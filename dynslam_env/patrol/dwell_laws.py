"""Dwell laws: how long doors stay closed and open, learned from looks at all doors of a place.

A law is a semi-Markov chain of two states whose dwell times are Erlang distributed: a chain of
phases (Cox and Miller 1965, section 6.2), so that a look, a gap and an unknown age are all exact
steps of a filter. The laws of a grid are compared by their likelihood of each door's looks. The
weights of the laws are shared by the doors (empirical Bayes, one step of EM a call): a new door is
expected to behave as the others, and its own looks decide as they become many.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from dynslam_env.navigation.door_belief import HORIZONS
from slam.geometry import Array
from slam.kernel import kernel

TICK = 0.1  # s, unit of time
DOUBLINGS = 14  # times of up to TICK * (2 ** DOUBLINGS - 1) s, 27 min; longer gaps count as that
PHASES = 6  # largest shape of an Erlang law; its dwell times deviate by 41 % of their mean
SHAPES = (1, PHASES)  # 1: memoryless, 6: about as regular as a uniform law
MEAN_DWELLS = 5.0 * 2.0 ** np.arange(8)  # s, 5 to 640
REGULAR = len(MEAN_DWELLS) ** 2  # laws before those of shape PHASES: these use two phases
LOOK_ERROR = 1e-3  # P(a confirmed look shows the other state)
UNEQUAL = 0.25  # prior weight of a law for each doubling of one mean dwell over the other
TRUST = 0.5  # exponent of the likelihood: looks are not independent of what is seen
PRIOR_WEIGHT = 1.0  # doors that the prior counts as


class DwellLaws:
    """The laws that are compared, h of them; the last: no flip ever.

    steps  (h, DOUBLINGS, 2 PHASES, 2 PHASES) transition probabilities over TICK * 2 ** j s
    across (DOUBLINGS, 2 PHASES, 2 PHASES, h) the same
    ahead  (h, HORIZONS, 2 PHASES) P(closed) at each of HORIZONS from each phase
    begin  (h, 2 PHASES) stationary distribution; phases 0 to PHASES - 1 are open, the rest closed
    prior  (h,) weights of the laws of doors that flip, before any look; 0 for the last
    """

    def __init__(self) -> None:
        rates = [_rates(k, o, c) for k in SHAPES for o in MEAN_DWELLS for c in MEAN_DWELLS]
        begins = [_begin(k, o, c) for k in SHAPES for o in MEAN_DWELLS for c in MEAN_DWELLS]
        step = expm(np.array([*rates, np.zeros_like(rates[0])]) * TICK)
        doubled = [step]
        for _ in range(DOUBLINGS - 1):
            doubled.append(doubled[-1] @ doubled[-1])
        self.steps: Array = np.ascontiguousarray(np.stack(doubled, axis=1), dtype=np.float64)
        self.across = np.ascontiguousarray(np.moveaxis(self.steps, 0, -1))
        self.ahead = _ahead(self.steps)
        self.begin = np.array([*begins, _begin(1, 1.0, 1.0)])
        i, j = np.indices((len(MEAN_DWELLS),) * 2)
        weights = np.tile(UNEQUAL ** abs(i - j).ravel(), len(SHAPES))
        self.prior = np.append(weights / weights.sum(), 0.0)


@cache
def dwell_laws() -> DwellLaws:
    """The laws; they are the same for all places."""
    return DwellLaws()


def _rates(shape: int, mean_open: float, mean_closed: float) -> Array:
    """(2 PHASES, 2 PHASES) rates of the chain of phases, 1/s; unused phases have none."""
    phases = np.array([*range(shape), *range(PHASES, PHASES + shape)])
    leaving = np.repeat([shape / mean_open, shape / mean_closed], shape)
    rates = np.zeros((2 * PHASES, 2 * PHASES))
    rates[phases, np.roll(phases, -1)] = leaving
    rates[phases, phases] = -leaving
    return rates


def _begin(shape: int, mean_open: float, mean_closed: float) -> Array:
    """(2 PHASES,) stationary distribution: a state by its mean dwell, its phases alike."""
    begin = np.zeros(2 * PHASES)
    begin[:shape] = mean_open
    begin[PHASES : PHASES + shape] = mean_closed
    return begin / begin.sum()


def _ahead(steps: Array) -> Array:
    """(h, HORIZONS, 2 PHASES) P(closed) at each of HORIZONS from each phase."""
    closed = np.repeat([[0.0, 1.0]], PHASES, axis=1).reshape(1, 2 * PHASES, 1)
    found = []
    for ticks in np.round(HORIZONS / TICK).astype(np.int64):
        after = np.broadcast_to(closed, (len(steps), 2 * PHASES, 1))
        for j in range(DOUBLINGS):
            after = steps[:, j] @ after if ticks >> j & 1 else after
        found.append(after[..., 0])
    return np.ascontiguousarray(np.stack(found, axis=1))


class Expected(NamedTuple):
    """What h laws expect of a door.

    closed     (h,) P(closed now)
    forecast   (h, HORIZONS) P(closed) at each of HORIZONS from now
    evidence   (2, h) log-likelihood of the looks, if a look now shows it open, or closed
    looked     (2, h, HORIZONS) P(closed) at each of HORIZONS after that look
    """

    closed: Array
    forecast: Array
    evidence: Array
    looked: Array


class DoorFilter:
    """The filters of one door, one for each law.

    phases     (h, 2 PHASES) at the last look
    evidence   (h,) log-likelihood of the looks
    time       s, of the last look; None before
    state      whether the door was closed at the last look
    flips      changes between confirmed looks
    watched    s between looks less than a second apart
    """

    def __init__(self, laws: DwellLaws):
        self._laws = laws
        self.phases, self.evidence = laws.begin.copy(), np.zeros(len(laws.begin))
        self.time: float | None = None
        self.state, self.flips, self.watched = False, 0, 0.0

    def look(self, time: float, closed: bool) -> None:
        """Add a confirmed look at `time`, s."""
        if self.time is not None:
            self.flips += closed != self.state
            gone = time - self.time
            self.watched += gone if gone < 1.0 else 0.0
        _look(self.phases, self._laws.across, self._ticks(time), closed, LOOK_ERROR, self.evidence)
        self.time, self.state = time, closed

    def closed(self, time: float) -> Array:
        """(h,) P(closed at `time`) by each law."""
        return _closed(self.phases, self._laws.across, self._ticks(time))

    def expected(self, time: float) -> Expected:
        """What each law expects at `time`, s, and from then on."""
        return Expected(
            *_expected(
                self.phases, self._laws.across, self._ticks(time), self._laws.ahead, LOOK_ERROR,
                self.evidence,
            )
        )  # fmt: skip

    def _ticks(self, time: float) -> int:
        gone = 0.0 if self.time is None else time - self.time
        return min(max(round(gone / TICK), 0), 2**DOUBLINGS - 1)


def with_still(weights: Array, still: float) -> Array:
    """(h,) `weights` (h,) of the laws of doors that flip, and the share of doors that never do."""
    mixed = (1.0 - still) * weights
    mixed[-1] = still
    return mixed


def responsibilities(evidence: Array, weights: Array) -> Array:
    """(d, h) P(law | looks) of doors with log-likelihoods (d, h), for weights (h,) or (d, h)."""
    with np.errstate(divide="ignore"):
        logs = TRUST * evidence + np.log(weights)
    shares = np.exp(logs - logs.max(axis=-1, keepdims=True))
    return shares / shares.sum(axis=-1, keepdims=True)


@kernel
def _advanced(phases, across, ticks):
    """(2 PHASES, h) the phases (h, 2 PHASES) after `ticks`; side by side, the laws are fast."""
    n = len(phases)
    rows, before = np.ascontiguousarray(phases.T), np.empty((2 * PHASES, n))
    for j in range(len(across)):
        if (ticks >> j) & 1:
            before[:], rows[:] = rows, 0.0
            for a in range(2 * PHASES):
                for b in range(2 * PHASES):
                    first = REGULAR if a % PHASES or b % PHASES else 0
                    for h in range(np.uint64(first), np.uint64(n)):
                        rows[b, h] += before[a, h] * across[j, a, b, h]
    return rows


@kernel
def _look(phases, across, ticks, closed, error, evidence):
    rows = _advanced(phases, across, ticks)
    _condition(rows, closed, error, evidence)
    phases[:] = rows.T


@kernel
def _condition(rows, closed, error, evidence):
    """Condition the phases (2 PHASES, h) on a look, and add its log-likelihood."""
    total = np.zeros(len(evidence))
    for a in range(2 * PHASES):
        share = 1.0 - error if closed == (a >= PHASES) else error
        for h in range(len(evidence)):
            rows[a, h] *= share
            total[h] += rows[a, h]
    for h in range(len(evidence)):
        evidence[h] += np.log(total[h])
        for a in range(2 * PHASES):
            rows[a, h] /= total[h]


@kernel
def _closed(phases, across, ticks):
    return _sum_closed(_advanced(phases, across, ticks))


@kernel
def _sum_closed(rows):
    found = np.zeros(rows.shape[1])
    for a in range(PHASES, 2 * PHASES):
        for h in range(rows.shape[1]):
            found[h] += rows[a, h]
    return found


@kernel
def _forecast(rows, ahead):
    found = np.zeros(ahead.shape[:2])
    for h in range(rows.shape[1]):
        for t in range(ahead.shape[1]):
            for a in range(2 * PHASES):
                found[h, t] += rows[a, h] * ahead[h, t, a]
    return found


@kernel
def _expected(phases, across, ticks, ahead, error, evidence):
    rows, after = _advanced(phases, across, ticks), np.empty((2, *ahead.shape[:2]))
    both = np.empty((2, len(evidence)))
    for closed in range(2):
        looked = rows.copy()
        both[closed] = evidence
        _condition(looked, closed == 1, error, both[closed])
        after[closed] = _forecast(looked, ahead)
    return _sum_closed(rows), _forecast(rows, ahead), both, after
