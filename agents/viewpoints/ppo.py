"""PPO for viewpoints in the fast setting. Needs `dynslam[train]`.

Proximal policy optimisation (Schulman et al. 2017) of a semi-Markov decision process: decisions
last differently long, so rewards and values are discounted by the time that passed.

A training is a sequence of segments. At the beginning of each, all generators are seeded by the
training's seed and the segment's number, and new patrols begin: a training that was interrupted
and resumed equals an uninterrupted one to the byte.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from agents.viewpoints.chooser import EXPLORE_TIME
from agents.viewpoints.floors import Floors
from agents.viewpoints.network import Inputs, ViewpointNetwork, inputs
from agents.viewpoints.patrols import BUDGET, EXPLORE, Patrols
from agents.viewpoints.situation import ViewpointPolicy

USUAL_ERROR = 0.1  # squared error, at which the reward is 0; it changes no policy
REWARD_SCALE = 0.1
MIN_RATE = 0.02  # share of the learning rate that is left at the end
Chooser = Callable[[Patrols], np.ndarray]
"""The next viewpoints (n,) of n patrols."""


@dataclass(frozen=True)
class Settings:
    """Of a training.

    patrols  at once
    length   decisions of each patrol in a rollout
    updates  rollouts in a segment
    epochs   over each rollout
    batch    decisions in a step of the optimiser
    rate     of learning at the start; it falls to 0
    clip     of the ratio of probabilities
    entropy  weight of the entropy
    horizon  s, in which the discount falls to 1/e
    trace    lambda of the advantages (Schulman et al. 2016)
    judging  first decisions, from which only the values are learned
    """

    patrols: int = 256
    length: int = 32
    updates: int = 20
    epochs: int = 3
    batch: int = 1024
    rate: float = 7e-4
    clip: float = 0.15
    entropy: float = 0.002
    horizon: float = 300.0
    trace: float = 0.95
    judging: int = 32768

    @property
    def segment(self) -> int:
        """Decisions of a segment."""
        return self.patrols * self.length * self.updates


class Rollout(NamedTuple):
    """The decisions of a rollout in a row."""

    inputs: Inputs
    actions: Tensor
    logs: Tensor
    advantages: Tensor
    returns: Tensor


class Learner:
    """One training; the same seed gives the same policy.

    network    that learns
    decisions  made so far
    segments   learned so far
    """

    def __init__(self, floors: Floors, seed: int, steps: int, settings: Settings = Settings()):
        torch.manual_seed(seed)
        torch.set_num_threads(1)
        self.settings, self._floors, self._seed, self._steps = settings, floors, seed, steps
        self.decisions = self.segments = 0
        self.network = ViewpointNetwork()
        self._optimiser = torch.optim.Adam(self.network.parameters(), settings.rate)

    def segment(self, told: Callable[[int], None] = lambda decisions: None) -> None:
        """Learn one segment; `told` gets the number of decisions after each rollout."""
        self._rng = np.random.default_rng([self._seed, self.segments])
        self._draws = torch.Generator().manual_seed(int(self._rng.integers(2**62)))
        self._patrols = Patrols(self._floors, self.settings.patrols, self._rng)
        for _ in range(self.settings.updates):
            self._update()
            told(self.decisions)
        self.segments += 1

    def arrays(self) -> dict[str, np.ndarray]:
        """All that the learning goes on from, as arrays: a checkpoint."""
        counts = np.array([self.decisions, self.segments])
        weights = {f"network/{k}": x.numpy() for k, x in self.network.state_dict().items()}
        moments = {
            f"adam/{k}/{name}": np.asarray(x)
            for k, kept in sorted(self._optimiser.state_dict()["state"].items())
            for name, x in kept.items()
        }
        return {"counts": counts} | weights | moments

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Go on from what `arrays` gave. Raises KeyError, ValueError or RuntimeError for others."""
        self.decisions, self.segments = (int(count) for count in arrays["counts"])
        weights = {k: torch.from_numpy(arrays[f"network/{k}"]) for k in self.network.state_dict()}
        self.network.load_state_dict(weights)
        state = self._optimiser.state_dict()
        for k, weight in enumerate(self.network.parameters()):
            if f"adam/{k}/{MOMENTS[0]}" not in arrays:
                continue  # it has not learned yet, as the choice before the values
            kept = {name: torch.from_numpy(arrays[f"adam/{k}/{name}"].copy()) for name in MOMENTS}
            if any(kept[name].shape != weight.shape for name in MOMENTS[1:]):
                raise ValueError("moments of another network")
            state["state"][k] = kept
        self._optimiser.load_state_dict(state)

    def _update(self) -> None:
        """One rollout, and the learning from it."""
        left = max(1.0 - self.decisions / self._steps, MIN_RATE)
        self._optimiser.param_groups[0]["lr"] = self.settings.rate * left
        rollout = self._rollout()
        for _ in range(self.settings.epochs):
            order = torch.from_numpy(self._rng.permutation(len(rollout.actions)))
            for rows in order.split(self.settings.batch):
                self._learn(rollout, rows)
        self.decisions += len(rollout.actions)

    def _rollout(self) -> Rollout:
        kept, told = [], []
        for _ in range(self.settings.length):
            given, logits, values = self._judged()
            drawn = torch.distributions.Categorical(logits=logits)
            actions = torch.multinomial(drawn.probs, 1, generator=self._draws)[:, 0]
            error, takes, over = self._patrols.step(actions.numpy())
            self._patrols.restart_all(over)
            self._patrols.look()
            kept.append((given, actions, drawn.log_prob(actions)))
            told.append((values.numpy(), error, takes, over))
        advantages, returns = self._advantages(told, self._judged()[2].numpy())
        given = Inputs(*(torch.cat(part) for part in zip(*(k[0] for k in kept), strict=True)))
        actions, logs = (torch.cat([k[j] for k in kept]) for j in (1, 2))
        return Rollout(given, actions, logs, advantages, returns)

    def _judged(self) -> tuple[Inputs, Tensor, Tensor]:
        """What the network reads now, its logits and values."""
        given = inputs_of(self._patrols)
        with torch.no_grad():
            return given, *self.network(given)

    def _advantages(self, told: list[Any], after: np.ndarray) -> tuple[Tensor, Tensor]:
        """Generalised advantages, discounted by time; nothing comes after an episode's end."""
        settings, gathered, advantages = self.settings, np.zeros(len(after)), []
        for values, error, takes, over in reversed(told):
            reward = REWARD_SCALE * (USUAL_ERROR * takes - error)
            discount = np.exp(-takes / settings.horizon)
            surprise = reward + discount * np.where(over, 0.0, after) - values
            gathered = surprise + discount * settings.trace * np.where(over, 0.0, gathered)
            advantages.append(gathered.copy())
            after = values
        found = np.array(advantages[::-1])
        returns = found + np.array([t[0] for t in told])
        return _tensor(found), _tensor(returns)

    def _learn(self, rollout: Rollout, rows: Tensor) -> None:
        """One step of the optimiser."""
        logits, values = self.network(Inputs(*(part[rows] for part in rollout.inputs)))
        loss = 0.5 * (values - rollout.returns[rows]).square().mean()
        if self.decisions >= self.settings.judging:
            drawn = torch.distributions.Categorical(logits=logits)
            advantages = rollout.advantages[rows]
            advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-6)
            ratio = (drawn.log_prob(rollout.actions[rows]) - rollout.logs[rows]).exp()
            clipped = ratio.clamp(1 - self.settings.clip, 1 + self.settings.clip)
            gain = torch.min(ratio * advantages, clipped * advantages).mean()
            loss = loss - gain - self.settings.entropy * drawn.entropy().mean()
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), 0.5)
        self._optimiser.step()


MOMENTS = ("step", "exp_avg", "exp_avg_sq")  # that Adam keeps of each weight


def _tensor(rows: np.ndarray) -> Tensor:
    return torch.from_numpy(rows.ravel().astype(np.float32))


def inputs_of(patrols: Patrols) -> Inputs:
    """What the network reads of patrols in the fast setting."""
    return inputs(patrols.features, patrols.fit)


def by_network(network: ViewpointNetwork) -> Chooser:
    """The viewpoints with the largest logits."""

    def choose(patrols: Patrols) -> np.ndarray:
        with torch.no_grad():
            return network(inputs_of(patrols))[0].argmax(dim=1).numpy()

    return choose


def by_feature(number: int, explored: float = EXPLORE_TIME) -> Chooser:
    """Exploring up to `explored` s; then the viewpoints with the largest value of one feature."""

    def choose(patrols: Patrols) -> np.ndarray:
        best = np.where(patrols.fit, patrols.features[..., number], -np.inf)[:, :EXPLORE]
        return np.where(_explores(patrols, explored), EXPLORE, best.argmax(axis=1))

    return choose


def by_policies(policies: list[ViewpointPolicy], explored: float = EXPLORE_TIME) -> Chooser:
    """Exploring up to `explored` s; then the viewpoints that policies choose, one of each
    patrol."""

    def choose(patrols: Patrols) -> np.ndarray:
        first, chosen = _explores(patrols, explored), np.full(len(policies), EXPLORE)
        for i in np.flatnonzero(~first):
            chosen[i] = policies[i].choose(patrols.situation(int(i)))
        return chosen

    return choose


def _explores(patrols: Patrols, explored: float) -> np.ndarray:
    """(n,) whether patrols that explore first still do."""
    fit, early = patrols.fit, patrols.state.time < explored
    return fit[:, EXPLORE] & (early | ~fit[:, :EXPLORE].any(axis=1))


def scores(floors: Floors, choose: Chooser, seed: int, episodes: int = 1) -> np.ndarray:
    """(n * episodes,) mean squared error over doors and time of `episodes` on each of n floors."""
    n = len(floors.doors)
    patrols, found = Patrols(floors, n * episodes, np.random.default_rng(seed)), []
    for i in range(n * episodes):
        patrols.restart(i, i % n)
    patrols.look()
    found = np.full(n * episodes, np.nan)
    while np.isnan(found).any():
        over = patrols.step(choose(patrols))[2] & np.isnan(found)
        state = patrols.state
        found[over] = state.error[over] / BUDGET
        patrols.look()
    return found
