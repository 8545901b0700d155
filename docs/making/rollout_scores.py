"""`python -m docs.making.rollout_scores best.npz`: how much is to be gained by better choices.

A rollout oracle in the fast setting: at each decision it tries the likeliest choices of a policy in
copies of the patrol, goes on with the policy there, and takes the choice with the least error. It
is one step of policy improvement, without any error of learning. Two kinds of futures:

* the true one: floor, doors and their flips to come are known, up to the end of the episode;
* imagined ones: doors as they are believed to be, drawn anew from the beliefs for each future (the
  same for all choices), over some time. A doorway that is not known is seen as it truly is by the
  drive that shows it, and forgotten after that drive: a little of the truth, in the oracle's
  favour. With a margin, another choice than the policy's is taken only if it is better by more
  than chance.

Prints the error of the policy, of `greedy` and of the oracles on the floors of `fast_scores`, one
patrol each, and the paired difference to the policy, with its 95 % t interval over floors.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch

from agents.viewpoints.features import GREEDY
from agents.viewpoints.floors import Floors, draw_floors
from agents.viewpoints.laws import Laws
from agents.viewpoints.learned import load_network
from agents.viewpoints.network import FAR, Inputs, ViewpointNetwork
from agents.viewpoints.patrols import BUDGET, Patrols, State
from agents.viewpoints.ppo import Chooser, by_feature, by_network, inputs_of
from docs.making.fast_scores import FIRST, FLOORS, PATROLS, SEED, interval
from dynslam_env.patrol.dwell_laws import PHASES, TICK
from dynslam_env.worlds.office import Office
from slam.geometry import Array
from slam.kernel import kernel

ROWS = 512  # copies that are driven at once
IMAGINED_STEP = 20  # TICKs between two states of an imagined door


class Futures(NamedTuple):
    """How an oracle looks ahead.

    choices  tried at a decision, the likeliest of the policy
    futures  of each; 0: the true one
    horizon  s
    margin   standard errors by which another choice must be better than the policy's
    """

    choices: int
    futures: int
    horizon: float
    margin: float = 0.0


ORACLES = {
    "the true future": Futures(8, 0, BUDGET),
    "16 imagined futures of 90 s": Futures(4, 16, 90.0, 1.5),
    "4 imagined futures of 60 s": Futures(4, 4, 60.0),
}


class Oracle:
    """Chooses by rollouts of a network.

    network  the policy
    ahead    how it looks ahead
    rng      of the imagined futures
    """

    def __init__(self, network: ViewpointNetwork, ahead: Futures, rng: np.random.Generator):
        self._network, self._choose, self._ahead, self._rng = (
            network, by_network(network), ahead, rng)  # fmt: skip

    def __call__(self, patrols: Patrols) -> np.ndarray:
        """The choices of n patrols."""
        tried, errors = self.errors(patrols, np.arange(len(patrols.fit)))
        return np.take_along_axis(tried, errors.argmin(axis=1)[:, None], axis=1)[:, 0]

    def errors(self, patrols: Patrols, rows: np.ndarray) -> tuple[np.ndarray, Array]:
        """Of n `rows` of patrols, the choices that are tried (n, choices), and the mean error, s,
        of the futures that begin with each, with the margin."""
        with torch.no_grad():
            given = inputs_of(patrols)
            logits = self._network(Inputs(given.views[rows], given.fit[rows]))[0].numpy()
        tried = np.argsort(-logits, axis=1, kind="stable")[:, : self._ahead.choices]
        usable = np.take_along_axis(logits, tried, axis=1) > FAR / 2
        tried = np.where(usable, tried, tried[:, :1])
        errors, many = np.zeros(tried.shape), max(self._ahead.futures, 1)
        each = max(ROWS // (tried.shape[1] * many), 1)
        for first in range(0, len(tried), each):
            part = slice(first, first + each)
            errors[part] = self._errors(patrols, rows[part], tried[part])
        return tried, errors

    def _errors(self, patrols: Patrols, rows: np.ndarray, tried: np.ndarray) -> Array:
        """(n, choices) s, mean error of the futures that begin with each choice, with the
        margin."""
        n, choices = tried.shape
        many = max(self._ahead.futures, 1)
        origin, order = np.repeat(rows, choices * many), np.repeat(np.arange(n), choices * many)
        futures = copied(patrols, origin)
        if self._ahead.futures:
            drawn = np.tile(np.arange(many), n * choices) + many * order
            seeds = self._rng.integers(2**31, size=n * many)[drawn]
            unknown = imagine(futures, seeds, self._ahead.horizon)
        else:
            unknown = np.zeros(futures.state.age.shape, np.bool_)
        until = np.minimum(futures.state.time + self._ahead.horizon, BUDGET)
        found, actions = np.zeros(len(origin)), np.repeat(tried.ravel(), many)
        left = np.arange(len(origin))
        while True:
            before = futures.state.time.copy()
            error, takes, _ = futures.step(actions)
            futures.state.age[unknown] = np.inf
            counted = np.minimum(BUDGET - before, takes)
            found[left] += error * np.minimum((until - before) / counted, 1.0)
            going = futures.state.time < until
            if not going.any():
                found = found.reshape(n, choices, many)
                spread = (found - found[:, :1]).std(axis=2, ddof=min(many - 1, 1))
                return found.mean(axis=2) + self._ahead.margin * spread / many**0.5
            if not going.all():
                futures = copied(futures, np.flatnonzero(going))
                unknown, until, left = unknown[going], until[going], left[going]
            futures.look()
            actions = self._choose(futures)


def copied(patrols: Patrols, rows: np.ndarray) -> Patrols:
    """Patrols in the state of some `rows` of others; they share floors and laws."""
    made = object.__new__(Patrols)
    made.__dict__.update(patrols.__dict__)
    state: list[Any] = [part[rows] for part in patrols.state]
    made.state = State(*state)
    for name in ("features", "fit", "stale", "fresh"):
        setattr(made, name, getattr(patrols, name)[rows])
    return made


def imagine(patrols: Patrols, seeds: np.ndarray, horizon: float) -> np.ndarray:
    """Let doors be as they are believed to be: all known doorways count, those without a leaf, too;
    (n, D) doorways that are not known."""
    state, floors = patrols.state, patrols.floors
    unknown = ~np.isfinite(state.age)
    patrols.floors = floors._replace(leaves=floors.doors)
    state.hidden[state.hidden > 0.0] = np.inf
    flips = np.full((*unknown.shape, int(horizon / (IMAGINED_STEP * TICK)) + 1), np.inf)
    _imagine(state, floors, patrols._laws, seeds, flips)
    patrols.state = state._replace(flips=flips)
    return unknown


@kernel
def _imagine(state: State, floors: Floors, laws: Laws, seeds, flips):
    """Draw doors (n, D) and their flips (n, D, F), s, from the beliefs about them."""
    steps = laws.steps[IMAGINED_STEP]
    for i in range(len(seeds)):
        np.random.seed(seeds[i])  # noqa: NPY002  (of the kernel)
        for d in range(floors.doors[state.floor[i]]):
            if not np.isfinite(state.age[i, d]):
                continue
            h = _draw(state.weights[i, d])
            phase = _draw(state.phases[i, d, h])
            state.closed[i, d], k = phase >= PHASES, 0
            for t in range(flips.shape[2] - 1):
                then = _draw(steps[h, phase])
                if (then >= PHASES) != (phase >= PHASES):
                    flips[i, d, k] = state.time[i] + (t + 0.5) * IMAGINED_STEP * TICK
                    k += 1
                phase = then


@kernel
def _draw(weights):
    """The index of one of some weights, by its share."""
    left = np.random.random() * weights.sum()  # noqa: NPY002
    for k in range(len(weights) - 1):
        left -= weights[k]
        if left < 0.0:
            return k
    return len(weights) - 1


def first_patrols(floors: Floors) -> Patrols:
    """The first patrol of each floor, with the doors of `fast_scores`."""
    n = len(floors.doors)
    patrols = Patrols(floors, n * PATROLS, np.random.default_rng(SEED))
    for i in range(n * PATROLS):
        patrols.restart(i, i % n)
    patrols.look()
    return copied(patrols, np.arange(n))


def driven(floors: Floors, choose: Chooser) -> Array:
    """(n,) mean squared error of the doors of one patrol on each floor."""
    patrols = first_patrols(floors)
    found = np.full(len(floors.doors), np.nan)
    left = np.arange(len(found))
    while len(left):
        over = patrols.step(choose(patrols))[2]
        found[left[over]] = patrols.state.error[over] / BUDGET
        patrols, left = copied(patrols, np.flatnonzero(~over)), left[~over]
        patrols.look()
    return found


def main(paths: list[str]) -> None:
    """Score a policy, the oracles that improve it, and `greedy`."""
    torch.set_num_threads(1)
    floors = draw_floors(Office(), "validation", FIRST, FLOORS)
    network = load_network(Path(paths[0]))
    usual = driven(floors, by_network(network))
    print(f"{paths[0]}: {usual.mean():.4f}, {len(usual)} floors")
    oracles: dict[str, Chooser] = {"greedy": by_feature(GREEDY)}
    oracles |= {name: Oracle(network, ahead, np.random.default_rng(SEED))
                for name, ahead in ORACLES.items()}  # fmt: skip
    for name, choose in oracles.items():
        errors = driven(floors, choose)
        less, (low, high) = usual - errors, interval(usual - errors)
        print(f"{name}: {errors.mean():.4f}, less than the policy by {less.mean():.4f} "
              f"({low:.4f} to {high:.4f})", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1:])
