"""`python -m docs.making.imitated TRAINING best.npz OUT MINUTES STEPS`: an imitation of the oracle.

The rollout oracle with the true future (`rollout_scores`) labels decisions of the policy on the
floors of a training: the error over HORIZON s after each of the likeliest choices. These errors are
fair samples of what each choice costs, since the policy does not see the future. The network is
trained to choose those that cost least (the expected cost of its choice; not the oracle's choice
itself, which is the best in hindsight). Writes the labels to OUT/labels.npz and the network of the
best epoch, by labels of floors that are held out, to OUT/imitated.npz. PPO goes on from there for
STEPS decisions; the best of its evaluations on the training's held-out floors is OUT/refined.npz.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from agents.viewpoints.floors import Floors
from agents.viewpoints.learned import load_network, save_network
from agents.viewpoints.network import Inputs, ViewpointNetwork
from agents.viewpoints.patrols import Patrols
from agents.viewpoints.ppo import Learner, Settings, by_network, inputs_of, scores
from agents.viewpoints.train import EPISODES, EVALUATION_SEED
from docs.making.rollout_scores import Futures, Oracle

HORIZON = 100.0  # s
CHOICES = 6
DRAWN = 0.15  # share of the decisions that are drawn among the likeliest ones
LABELLED = 0.05  # share of the decisions that are labelled
PATROLS = 512
HELD = 0.15  # share of the floors whose labels choose the epoch
EPOCHS, BATCH, RATE = 15, 512, 3e-4
RESTRAINT = 0.2  # s of error, of a nat of difference to the policy
REFINING_RATE = 3e-4  # of PPO afterwards


def labels(floors: Floors, network: ViewpointNetwork, seconds: float, seed: int) -> dict[str, Any]:
    """Decisions and the errors of their choices, as many as there is time for."""
    rng, choose = np.random.default_rng(seed), by_network(network)
    patrols, found, end = Patrols(floors, PATROLS, rng), [], time.time() + seconds
    oracle = Oracle(network, Futures(CHOICES, 0, HORIZON), rng)
    while time.time() < end:
        rows = np.flatnonzero(rng.random(PATROLS) < LABELLED)
        tried, errors = oracle.errors(patrols, rows)
        found.append((
            patrols.features[rows].astype(np.float32), patrols.fit[rows], tried,
            errors.astype(np.float32), patrols.state.floor[rows], patrols.state.time[rows],
        ))  # fmt: skip
        actions = choose(patrols)
        drawn = np.flatnonzero(rng.random(PATROLS) < DRAWN)
        with torch.no_grad():
            logits = network(inputs_of(patrols))[0].numpy()[drawn]
        noisy = logits + 2.0 * rng.gumbel(size=logits.shape)
        actions[drawn] = np.where(patrols.fit[drawn], noisy, -np.inf).argmax(axis=1)
        patrols.restart_all(patrols.step(actions)[2])
        patrols.look()
    names = ("views", "fit", "tried", "errors", "floor", "time")
    columns = zip(*found, strict=True)
    return {name: np.concatenate(part) for name, part in zip(names, columns, strict=True)}


def cost(logits: Tensor, tried: Tensor, errors: Tensor) -> Tensor:
    """(n,) the expected error of a network's choice among those that were tried, less that of the
    first one, which the policy chose."""
    among = logits.gather(1, tried).softmax(dim=1)
    return (among * (errors - errors[:, :1])).sum(dim=1)


def imitated(network: ViewpointNetwork, found: dict[str, Any], seed: int) -> ViewpointNetwork:
    """The network, trained on labels, and restrained to the policy by RESTRAINT: choices that were
    not tried have no labels."""
    torch.manual_seed(seed)
    given = Inputs(torch.from_numpy(found["views"]), torch.from_numpy(found["fit"]))
    tried, errors = torch.from_numpy(found["tried"]), torch.from_numpy(found["errors"])
    held = torch.from_numpy(found["floor"] < HELD * (found["floor"].max() + 1))
    own, others = torch.nonzero(~held)[:, 0], torch.nonzero(held)[:, 0]
    with torch.no_grad():
        policy = network(given)[0].log_softmax(dim=1)

    def of(rows: Tensor) -> tuple[Tensor, Tensor]:
        logits = network(Inputs(given.views[rows], given.fit[rows]))[0]
        away = nn.functional.kl_div(policy[rows], logits.log_softmax(dim=1), log_target=True,
                                    reduction="none").sum(dim=1)  # fmt: skip
        return cost(logits, tried[rows], errors[rows]), away

    optimiser = torch.optim.Adam(network.parameters(), RATE)
    best, kept = np.inf, network.state_dict()
    for epoch in range(EPOCHS + 1):
        with torch.no_grad():
            (score, away), usual = of(others), of(own)[0].mean().item()
        half = 1.96 * score.std().item() / len(others) ** 0.5
        print(f"epoch {epoch}: {usual:.4f} s of error against the policy's choice, held-out floors "
              f"{score.mean():.4f} +- {half:.4f}, {away.mean():.4f} away", flush=True)  # fmt: skip
        if score.mean().item() < best:
            best = score.mean().item()
            kept = {name: weight.clone() for name, weight in network.state_dict().items()}
        for rows in own[torch.randperm(len(own))].split(BATCH):
            costs, away = of(rows)
            loss = (costs + RESTRAINT * away).mean()
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 0.5)
            optimiser.step()
    network.load_state_dict(kept)
    return network


def refined(
    network: ViewpointNetwork, floors: Floors, held: Floors, steps: int, seed: int
) -> Iterator[ViewpointNetwork]:
    """PPO from a network on; yields it after each evaluation that is the best so far."""
    learner, best = Learner(floors, seed, steps, Settings(judging=0, rate=REFINING_RATE)), np.inf
    learner.network.load_state_dict(network.state_dict())
    while True:
        score = scores(held, by_network(learner.network), EVALUATION_SEED, EPISODES).mean()
        print(f"{learner.decisions} decisions: {score:.5f}", flush=True)
        if score < best:
            best = score
            yield learner.network
        if learner.decisions >= steps:
            return
        learner.segment()


def main(training: str, policy: str, out: str, minutes: str, steps: str) -> None:
    """Label, train and write."""
    torch.set_num_threads(1)
    folder, path = Path(out), Path(training) / "floors.npz"
    folder.mkdir(parents=True, exist_ok=True)
    with np.load(path) as stored:
        floors, held = (Floors(*(stored[f"{split}/{name}"] for name in Floors._fields))
                        for split in ("train", "validation"))  # fmt: skip
    network = load_network(Path(policy))
    if not (folder / "labels.npz").exists():
        np.savez(folder / "labels.npz", **labels(floors, network, 60 * float(minutes), 1))
    with np.load(folder / "labels.npz") as stored:
        found = {name: stored[name] for name in stored.files}
    print(f"{len(found['time'])} decisions", flush=True)
    network = imitated(network, found, 1)
    save_network(network, folder / "imitated.npz")
    for better in refined(network, floors, held, int(steps), 1):
        save_network(better, folder / "refined.npz")


if __name__ == "__main__":
    main(*sys.argv[1:])
