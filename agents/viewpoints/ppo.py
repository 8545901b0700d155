"""PPO for viewpoints in the fast setting, and imitation of a planner. Needs `dynslam[train]`.

Proximal policy optimisation (Schulman et al. 2017) of a semi-Markov decision process: decisions
last differently long, so rewards and values are discounted by the time that passed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from agents.viewpoints.fast_patrols import Fast, FastPatrols
from agents.viewpoints.floors import Floors
from agents.viewpoints.network import Inputs, ViewpointNetwork, inputs
from agents.viewpoints.situation import Situation, ViewpointPolicy

USUAL_ERROR = 0.1  # squared error, at which the reward is 0; it changes no policy
REWARD_SCALE = 0.1
Chooser = Callable[[FastPatrols, Fast], np.ndarray]
"""The next viewpoints (n,) of n patrols."""


@dataclass(frozen=True)
class Settings:
    """Of a training.

    patrols     at once
    length      decisions of each patrol in a rollout
    epochs      over each rollout
    batch       decisions in a step of the optimiser
    rate        of learning at the start; it falls to 0
    clip        of the ratio of probabilities
    entropy     weight of the entropy
    horizon     s, in which the discount falls to 1/e
    trace       lambda of the advantages (Schulman et al. 2016)
    imitated    decisions of a teacher that are imitated first; of 2,048 it learned less than it
                knows at the beginning, when it is near `Greedy`
    judging     first decisions, from which only the values are learned
    """

    patrols: int = 64
    length: int = 16
    epochs: int = 3
    batch: int = 512
    rate: float = 2e-4
    clip: float = 0.1
    entropy: float = 0.001
    horizon: float = 90.0
    trace: float = 0.9
    imitated: int = 0
    judging: int = 8192


class Rollout(NamedTuple):
    """The decisions of a rollout in a row."""

    inputs: Inputs
    actions: Tensor
    logs: Tensor
    advantages: Tensor
    returns: Tensor


class Learner:
    """One training; the same seed gives the same policy.

    network   that learns
    decisions made so far
    """

    def __init__(self, floors: Floors, seed: int, steps: int, settings: Settings = Settings()):
        torch.manual_seed(seed)
        torch.set_num_threads(1)
        self.settings, self._steps, self.decisions = settings, steps, 0
        self.network = ViewpointNetwork()
        self._rng, self._draws = np.random.default_rng(seed), torch.Generator().manual_seed(seed)
        self._patrols = FastPatrols(floors, settings.patrols, self._rng)
        self._optimiser = torch.optim.Adam(self.network.parameters(), settings.rate)

    def imitate(self, teacher: Callable[[], ViewpointPolicy]) -> float:
        """Learn the choices of a policy; the share of the last rollouts' choices that agree."""
        settings, policies = self.settings, [teacher() for _ in range(self.settings.patrols)]
        data: list[tuple[Inputs, Tensor]] = []
        for _ in range(settings.imitated // settings.patrols):
            seen = self._patrols.seen()
            chosen = each(policies)(self._patrols, seen)
            data.append((inputs_of(seen), torch.from_numpy(chosen)))
            self._patrols.restart_all(self._patrols.step(chosen)[2])
        agreed = 0.0
        for _ in range(8 * settings.epochs):
            for k in self._rng.permutation(len(data) // 4) if len(data) >= 4 else []:
                some = data[4 * k : 4 * k + 4]
                given = _joined([one[0] for one in some])
                wanted = torch.cat([s[1] for s in some])
                logits, _ = self.network(given)
                self._improve(nn.functional.cross_entropy(logits, wanted))
                agreed += 0.02 * (float((logits.argmax(1) == wanted).float().mean()) - agreed)
        return agreed

    def update(self) -> dict[str, Any]:
        """One rollout, and the learning from it."""
        self._optimiser.param_groups[0]["lr"] = self.settings.rate * max(
            1.0 - self.decisions / self._steps, 0.02
        )
        rollout, error = self._rollout()
        entropies = []
        for _ in range(self.settings.epochs):
            order = torch.from_numpy(self._rng.permutation(len(rollout.actions)))
            for rows in order.split(self.settings.batch):
                entropies.append(self._learn(rollout, rows))
        self.decisions += len(rollout.actions)
        return {"decisions": self.decisions, "error": error, "entropy": float(np.mean(entropies))}

    def _rollout(self) -> tuple[Rollout, float]:
        """A rollout, and its error by the time that passed."""
        kept, told = [], []
        for _ in range(self.settings.length):
            given, logits, values = self._judged()
            drawn = torch.distributions.Categorical(logits=logits)
            actions = torch.multinomial(drawn.probs, 1, generator=self._draws)[:, 0]
            error, takes, over = self._patrols.step(actions.numpy())
            self._patrols.restart_all(over)
            kept.append((given, actions, drawn.log_prob(actions)))
            told.append((values.numpy(), error, takes, over))
        values = self._judged()[2]
        advantages, returns = self._advantages(told, values.numpy())
        given = _joined([one[0] for one in kept])
        actions, logs = (torch.cat([k[j] for k in kept]) for j in (1, 2))
        rate = sum(t[1].sum() for t in told) / sum(t[2].sum() for t in told)
        return Rollout(given, actions, logs, advantages, returns), float(rate)

    def _judged(self) -> tuple[Inputs, Tensor, Tensor]:
        """What the network reads now, its logits and values."""
        given = inputs_of(self._patrols.seen())
        with torch.no_grad():
            return given, *self.network(given)

    def _advantages(self, told: list[Any], after: np.ndarray) -> tuple[Tensor, Tensor]:
        """Generalised advantages, discounted by time; an episode's end has the value before it."""
        settings, gathered, advantages = self.settings, np.zeros(len(after)), []
        for values, error, takes, over in reversed(told):
            reward = REWARD_SCALE * (USUAL_ERROR * takes - error)
            discount = np.exp(-takes / settings.horizon)
            surprise = reward + discount * np.where(over, values, after) - values
            gathered = surprise + discount * settings.trace * np.where(over, 0.0, gathered)
            advantages.append(gathered.copy())
            after = values
        found = np.array(advantages[::-1])
        returns = found + np.array([t[0] for t in told])
        return _tensor(found), _tensor(returns)

    def _learn(self, rollout: Rollout, rows: Tensor) -> float:
        """One step of the optimiser; the entropy of the policy."""
        given = Inputs(*(part[rows] for part in rollout.inputs))
        logits, values = self.network(given)
        drawn = torch.distributions.Categorical(logits=logits)
        advantages = rollout.advantages[rows]
        advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-6)
        ratio = (drawn.log_prob(rollout.actions[rows]) - rollout.logs[rows]).exp()
        clipped = ratio.clamp(1 - self.settings.clip, 1 + self.settings.clip)
        gain = torch.min(ratio * advantages, clipped * advantages).mean()
        entropy = drawn.entropy().mean()
        if self.decisions < self.settings.judging:
            gain, entropy = 0.0 * gain, entropy.detach()
        error = (values - rollout.returns[rows]).square().mean()
        self._improve(0.5 * error - gain - self.settings.entropy * entropy)
        return float(entropy.detach())

    def _improve(self, loss: Tensor) -> None:
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), 0.5)
        self._optimiser.step()


def _tensor(rows: np.ndarray) -> Tensor:
    return torch.from_numpy(rows.ravel().astype(np.float32))


def _joined(rows: list[Inputs]) -> Inputs:
    return Inputs(*(torch.cat(part) for part in zip(*rows, strict=True)))


def inputs_of(seen: Fast) -> Inputs:
    """What the network reads of patrols in the fast setting."""
    now = Situation(seen.times, seen.sees, seen.between, seen.sees, seen.doors, -1)
    return inputs(now, seen.real.astype(np.float64))


def by_network(network: ViewpointNetwork) -> Chooser:
    """The viewpoints with the largest logits."""

    def choose(patrols: FastPatrols, seen: Fast) -> np.ndarray:
        with torch.no_grad():
            return network(inputs_of(seen))[0].argmax(dim=1).numpy()

    return choose


def each(policies: list[ViewpointPolicy]) -> Chooser:
    """The viewpoints that policies choose, one of each patrol."""

    def choose(patrols: FastPatrols, seen: Fast) -> np.ndarray:
        rows = enumerate(policies)
        return np.array([policy.choose(patrols.situation(i, seen)) for i, policy in rows])

    return choose


def scores(floors: Floors, choose: Chooser, seed: int, bare: float = 0.0) -> np.ndarray:
    """(n,) mean squared error over doors and time of one episode on each floor."""
    n = len(floors.doors)
    patrols, found = FastPatrols(floors, n, np.random.default_rng(seed), bare), np.full(n, np.nan)
    for i in range(n):
        patrols.restart(i, i)
    while np.isnan(found).any():
        over = patrols.step(choose(patrols, patrols.seen()))[2] & np.isnan(found)
        found[over] = patrols.error[over] / patrols.time[over]
    return found
