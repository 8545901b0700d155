"""`python -m docs.making.fast_scores [best.npz ...]`: policies of viewpoints in the fast setting.

On floors of the split validation on which no weights were chosen. Prints the mean squared error of
the doors of `greedy`, of the policies of the files, of `greedy` with the true doors and their
future, and the paired difference of each to `greedy`, with its 95 % t interval over floors.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.stats import t as student

from agents.viewpoints.chooser import EXPLORE_TIME
from agents.viewpoints.features import GREEDY, Ahead, Expected, describe
from agents.viewpoints.floors import Floors, draw_floors
from agents.viewpoints.laws import Laws
from agents.viewpoints.learned import load_network
from agents.viewpoints.patrols import EXPLORE, Patrols, State, reachable
from agents.viewpoints.ppo import Chooser, by_feature, by_network, scores
from dynslam_env.navigation.door_belief import HORIZONS
from dynslam_env.patrol.dwell_laws import LOOK_ERROR, TRUST
from dynslam_env.worlds.office import Office
from slam.kernel import kernel

FIRST, FLOORS = 1000, 60  # of the split validation
PATROLS, SEED = 8, 7  # on each floor


def main(paths: list[str]) -> None:
    """Score all choosers on the same floors and doors."""
    floors = draw_floors(Office(), "validation", FIRST, FLOORS)
    choosers: dict[str, Chooser] = {"greedy": by_feature(GREEDY)}
    choosers |= {path: by_network(load_network(Path(path))) for path in paths}
    choosers["greedy with the truth"] = by_truth
    usual = None
    for name, choose in choosers.items():
        errors = scores(floors, choose, SEED, PATROLS).reshape(PATROLS, -1).mean(axis=0)
        usual = errors if usual is None else usual
        less, (low, high) = usual - errors, interval(usual - errors)
        print(f"{name}: {errors.mean():.4f}, less than greedy by {less.mean():.4f} "
              f"({low:.4f} to {high:.4f}), {len(errors)} floors")  # fmt: skip


def interval(values: np.ndarray) -> tuple[float, float]:
    """The 95 % t interval of a mean."""
    half = student.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values))
    return values.mean() - half, values.mean() + half


def by_truth(patrols: Patrols) -> np.ndarray:
    """As `greedy`, which explores first, but by the errors that each look really will save: the
    doors and their flips to come are known, their beliefs stay as they are."""
    found, state = np.zeros_like(patrols.features), patrols.state
    _describe_truth(state, patrols.floors, patrols._laws, patrols.fit, found)
    best = np.where(patrols.fit, found[..., GREEDY], -np.inf)[:, :EXPLORE].argmax(axis=1)
    first = (state.time < EXPLORE_TIME) | ~patrols.fit[:, :EXPLORE].any(axis=1)
    return np.where(patrols.fit[:, EXPLORE] & first, EXPLORE, best)


@kernel
def _describe_truth(state: State, floors: Floors, laws: Laws, fit, found):
    for i in range(len(state.time)):
        floor, place = state.floor[i], state.place[i]
        known = np.flatnonzero(np.isfinite(state.age[i]))
        stale = np.zeros((len(known), len(HORIZONS)))
        fresh = np.zeros((len(known), len(HORIZONS)))
        for k in range(len(known)):
            if known[k] < floors.leaves[floor]:
                _errors(i, known[k], state, laws, stale[k], fresh[k])
        times = np.where(fit[i, :EXPLORE], floors.between[floor, place], np.inf)
        shown = state.missed[i][:, known] <= state.time[i]
        sees = floors.then[floor, place][:, known] & shown
        near = reachable(floors, floor, known, shown)
        ahead = Ahead(times, sees, near, len(known), place, state.time[i], np.inf)
        leaf = state.hidden[i][known] == 0.0
        describe(ahead, Expected(state.age[i][known], leaf, stale, fresh), found[i])


@kernel
def _errors(i, d, state: State, laws: Laws, stale, fresh):
    """Write the true squared errors (HORIZONS,) of a door, without and after a look now."""
    weights, phases = state.weights[i, d], state.phases[i, d]
    half = phases.shape[1] // 2
    closed = _closed(i, d, state, 0.0)
    after = np.empty(len(weights))  # weights after the look, over P(what it shows)
    total = 0.0
    for h in range(len(weights)):
        p = min(max(phases[h, half:].sum(), LOOK_ERROR), 1.0 - LOOK_ERROR)
        shown = p if closed else 1.0 - p
        after[h] = weights[h] * shown**TRUST
        total += after[h]
        after[h] /= shown
    first = half if closed else 0
    for t in range(len(stale)):
        truth, p, q = _closed(i, d, state, HORIZONS[t]), 0.0, 0.0
        for h in range(len(weights)):
            for a in range(2 * half):
                p += weights[h] * phases[h, a] * laws.ahead[h, t, a]
            for a in range(first, first + half):
                q += after[h] * phases[h, a] * laws.ahead[h, t, a]
        stale[t], fresh[t] = (p - truth) ** 2, (q / total - truth) ** 2


@kernel
def _closed(i, d, state: State, later):
    """Whether a door will be closed `later` s from now."""
    closed = state.closed[i, d]
    for time in state.flips[i, d]:
        if time > state.time[i] + later:
            break
        closed = not closed
    return closed


if __name__ == "__main__":
    main(sys.argv[1:])
