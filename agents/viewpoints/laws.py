"""Laws: how the doors of the fast setting are believed to move, with the steps of their filters.

A part of the laws of `DwellLaws`, with the same looks and forecasts, in kernels for many patrols.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from dynslam_env.patrol.dwell_laws import LOOK_ERROR, MEAN_DWELLS, TRUST, DwellLaws
from slam.geometry import Array
from slam.kernel import kernel

ALL_PAIRS = 80.0, 320.0  # s, between which laws of all pairs of MEAN_DWELLS are kept
MAX_TICKS = 120  # of a slice of a way


class Laws(NamedTuple):
    """The h laws of the beliefs, of P phases each, the first half of them open.

    steps  (MAX_TICKS, h, P, P) transition probabilities over a number of ticks
    ahead  (h, HORIZONS, P) P(closed) at each of HORIZONS from each phase
    begin  (h, P) stationary
    prior  (h,) weights for doors that flip; the last law, 0, is that of doors that never do
    """

    steps: Array
    ahead: Array
    begin: Array
    prior: Array


@cache
def laws() -> Laws:
    """The regular laws of `DwellLaws` with equal mean dwells, those with unequal ones near those of
    the doors, and the law that a door never flips."""
    every, shape = DwellLaws(), (2, len(MEAN_DWELLS), len(MEAN_DWELLS))
    number = np.arange(np.prod(shape)).reshape(shape)[1]
    near = (ALL_PAIRS[0] <= MEAN_DWELLS) & (ALL_PAIRS[1] >= MEAN_DWELLS)
    kept = np.outer(near, near) | np.eye(len(MEAN_DWELLS), dtype=np.bool_)
    chosen = np.append(number[kept], len(every.begin) - 1)
    one = every.steps[chosen, 0]
    steps = [np.broadcast_to(np.eye(one.shape[-1]), one.shape)]
    for _ in range(MAX_TICKS - 1):
        steps.append(steps[-1] @ one)
    prior = every.prior[chosen]
    return Laws(
        np.ascontiguousarray(steps), np.ascontiguousarray(every.ahead[chosen]),
        every.begin[chosen], prior / prior.sum(),
    )  # fmt: skip


@kernel
def advance(phases, steps):
    """The phases (h, P) of one door after a step (h, P, P)."""
    row = np.empty(phases.shape[1])
    for h in range(len(phases)):
        row[:] = 0.0
        for a in range(len(row)):
            if phases[h, a] > 0.0:
                for b in range(len(row)):
                    row[b] += phases[h, a] * steps[h, a, b]
        phases[h] = row


@kernel
def condition(evidence, weights, phases, closed):
    """Condition one door's beliefs on a look."""
    half, total = phases.shape[1] // 2, 0.0
    for h in range(len(weights)):
        if closed:
            phases[h, :half] *= LOOK_ERROR
            phases[h, half:] *= 1.0 - LOOK_ERROR
        else:
            phases[h, :half] *= 1.0 - LOOK_ERROR
            phases[h, half:] *= LOOK_ERROR
        p = phases[h].sum()
        phases[h] /= p
        evidence[h] += np.log(p)
        weights[h] *= p**TRUST
        total += weights[h]
    weights /= total


@kernel
def is_closed(weights, phases):
    """P(closed) of one door."""
    half, p = phases.shape[1] // 2, 0.0
    for h in range(len(weights)):
        p += weights[h] * phases[h, half:].sum()
    return p


@kernel
def expect(weights, phases, laws: Laws, stale, fresh):
    """Write the expected errors (HORIZONS,) of one doorway, without and after a look."""
    half, now, totals = phases.shape[1] // 2, 0.0, np.zeros(2)
    seen = np.empty((len(weights), 2))  # weights after a look, over P(what it shows)
    for h in range(len(weights)):
        p = 0.0
        for a in range(half, 2 * half):
            p += phases[h, a]
        p = min(max(p, LOOK_ERROR), 1.0 - LOOK_ERROR)
        now += weights[h] * p
        for k in range(2):
            shown = p if k else 1.0 - p
            seen[h, k] = weights[h] * shown**TRUST
            totals[k] += seen[h, k]
            seen[h, k] /= shown
    for t in range(len(stale)):
        later, opened, closed = 0.0, 0.0, 0.0
        for h in range(len(weights)):
            was_open, was_closed = 0.0, 0.0
            for a in range(half):
                was_open += phases[h, a] * laws.ahead[h, t, a]
                was_closed += phases[h, half + a] * laws.ahead[h, t, half + a]
            later += weights[h] * (was_open + was_closed)
            opened += seen[h, 0] * was_open
            closed += seen[h, 1] * was_closed
        opened, closed = opened / totals[0], closed / totals[1]
        stale[t] = later * (1.0 - later)
        fresh[t] = (1.0 - now) * opened * (1.0 - opened) + now * closed * (1.0 - closed)
