"""`python -m docs.making.tuned_with_slam OUT EPISODES`: the policy of viewpoints trained on with SLAM.

PPO goes on from the policy in the repository, by patrols of `DoorPatrol-v1` in offices of the split
train that no training drew. Writes a policy after each update, and a line with its patrols' mean.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import torch

from agents.goal_choosers.goal_agent import GoalAgent
from agents.registry import POLICIES
from agents.viewpoints.chooser import ViewpointChooser
from agents.viewpoints.features import features
from agents.viewpoints.learned import load_network, save_network
from agents.viewpoints.network import Inputs, ViewpointNetwork, inputs
from agents.viewpoints.patrols import BUDGET
from agents.viewpoints.ppo import REWARD_SCALE, USUAL_ERROR, Settings
from agents.viewpoints.situation import Situation
from dynslam_env.patrol.long_env import LongPatrolEnv

FIRST, PATROLS = 5000, 24  # floors of train; patrols before each update
EPOCHS, BATCH, RATE = 4, 256, 1e-4
USED = Settings()


class Drawn:
    """Draws viewpoints, and remembers what it read and chose."""

    def __init__(self, network: ViewpointNetwork, seed: int):
        self._network, self._draws = network, torch.Generator().manual_seed(seed)
        self.rows: list[tuple[Inputs, int, float, float, float]] = []

    def choose(self, situation: Situation) -> int:
        fit = np.isfinite([*situation.times, situation.frontier])
        given = inputs(features(situation)[None], fit[None])
        with torch.no_grad():
            logits, value = self._network(given)
        logs = logits.log_softmax(dim=1)[0]
        action = int(torch.multinomial(logs.exp(), 1, generator=self._draws))
        self.rows.append((given, action, float(logs[action]), float(value), situation.time))
        return action


def patrol(network: ViewpointNetwork, index: int):
    """Decisions of a patrol with advantages and returns, and its Brier score."""
    env = LongPatrolEnv()
    observation, info = env.reset(options={"split": "train", "index": index})
    policy = Drawn(network, index)
    agent = GoalAgent(env.unwrapped, ViewpointChooser(policy, explored=0.0), index)
    errors, times = [], [info["time"]]
    while info["time"] < BUDGET:
        observation, *_, info = env.step(agent.predict(observation)[0])
        errors.append(info["door_brier"])
        times.append(info["time"])
    until = np.array([*[row[4] for row in policy.rows], times[-1]])
    sums = np.concatenate([[0.0], np.cumsum(np.array(errors) * np.diff(times))])
    spent = np.diff(np.interp(until, times, sums))
    takes = np.diff(until)
    found, gathered, after = [], 0.0, 0.0
    for row, error, take in zip(policy.rows[::-1], spent[::-1], takes[::-1], strict=True):
        discount = np.exp(-take / USED.horizon)
        surprise = REWARD_SCALE * (USUAL_ERROR * take - error) + discount * after - row[3]
        gathered = surprise + discount * USED.trace * gathered
        found.append(gathered)
        after = row[3]
    return policy.rows, found[::-1], float(np.mean(errors))


def learn(network, optimiser, rows, advantages) -> None:
    most = max(row[0].fit.shape[1] for row in rows)

    def wide(part: torch.Tensor) -> torch.Tensor:
        """Exploring stays the last choice."""
        more = most - part.shape[1]
        empty = torch.zeros((1, more, *part.shape[2:]), dtype=part.dtype)
        return torch.cat([part[:, :-1], empty, part[:, -1:]], dim=1)

    given = Inputs(*(torch.cat([wide(row[0][k]) for row in rows]) for k in (0, 1)))
    actions = torch.tensor([
        most - 1 if row[1] == row[0].fit.shape[1] - 1 else row[1] for row in rows
    ])
    logs, values = (torch.tensor([row[k] for row in rows]) for k in (2, 3))
    advantages = torch.tensor(advantages, dtype=torch.float32)
    returns = advantages + values
    for _ in range(EPOCHS):
        for some in torch.randperm(len(rows)).split(BATCH):
            logits, value = network(Inputs(*(part[some] for part in given)))
            drawn = torch.distributions.Categorical(logits=logits)
            worth = advantages[some]
            worth = (worth - worth.mean()) / (worth.std() + 1e-6)
            ratio = (drawn.log_prob(actions[some]) - logs[some]).exp()
            clipped = ratio.clamp(1 - USED.clip, 1 + USED.clip)
            loss = 0.5 * (value - returns[some]).square().mean()
            loss = loss - torch.min(ratio * worth, clipped * worth).mean()
            loss = loss - USED.entropy * drawn.entropy().mean()
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 0.5)
            optimiser.step()


def main(out: Path, episodes: int) -> None:
    torch.manual_seed(0)
    torch.set_num_threads(1)
    out.mkdir(parents=True, exist_ok=True)
    network, decisions = load_network(POLICIES / "viewpoints.npz"), 0
    optimiser = torch.optim.Adam(network.parameters(), RATE)
    for first in range(FIRST, FIRST + episodes, PATROLS):
        rows, advantages, scores = [], [], []
        for index in range(first, first + PATROLS):
            more, worth, score = patrol(network, index)
            rows += more
            advantages += worth
            scores.append(score)
            print(time.strftime("%T"), index, len(more), f"{score:.4f}", file=sys.stderr, flush=True)
        decisions += len(rows)
        learn(network, optimiser, rows, advantages)
        save_network(network, out / f"{decisions}.npz")
        print(f"{time.strftime('%T')} {decisions} {np.mean(scores):.4f}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
