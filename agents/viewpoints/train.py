"""A training of a policy of viewpoints in a folder, from which it can go on after any interruption.

Files: config.json, floors.npz (the floors drawn), progress.jsonl (a line for each segment),
checkpoint.npz and best.npz. Needs `dynslam[train]`.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agents.training.training_folder import find_config, keep_config
from agents.viewpoints.floors import Floors, draw_floors
from agents.viewpoints.learned import save_network
from agents.viewpoints.ppo import Learner, Settings, by_network, scores
from dynslam_env.simulation.find_world import find_world
from slam.benchmark.results import append, read
from slam.errors import InputError
from slam.io.arrays import read_arrays
from slam.io.files import placing, replacing
from slam.io.guard import guarded
from slam.io.one_line import one_line

CHECKPOINT, BEST = "checkpoint.npz", "best.npz"
PROGRESS, FLOORS = "progress.jsonl", "floors.npz"
FIRST_FLOORS = {"train": 100, "validation": 0}  # floors of train before were looked at by hand
EVALUATION_SEED = 1
USUAL = Settings()
EPISODES = 4  # of an evaluation on each held-out floor


@dataclass(frozen=True)
class ViewpointTraining:
    """What a training is.

    world    a registered name, a world file, or FILE.py:NAME
    seed     of the learning
    steps    decisions in all
    trained  number of floors of the split train
    held     number of floors of the split validation, on which it is evaluated
    settings of PPO
    """

    world: str = "office"
    seed: int = 0
    steps: int = 5_000_000
    trained: int = 160
    held: int = 40
    settings: Settings = USUAL


class Reporter:
    """Is told how a training goes on; this one does nothing."""

    def floors(self, count: int, total: int) -> None:
        """`count` of `total` floors are drawn."""

    def decisions(self, count: int) -> None:
        """So many decisions were learned from."""

    def evaluated(self, row: dict[str, Any]) -> None:
        """A line of progress.jsonl: `steps` (decisions) and `door_brier`."""


def train(
    training: ViewpointTraining, folder: Path, resume: bool = False, told: Reporter | None = None
) -> None:
    """Train, or go on with the training in the folder; a resumed training equals one that was
    never interrupted, to the byte. Raises InputError for a folder with another training."""
    told, plain = told or Reporter(), json.loads(json.dumps(asdict(training)))
    find_config(plain, folder, resume)
    keep_config(plain, folder)
    trained, held = _floors(training, folder, told)
    learner = Learner(trained, training.seed, training.steps, training.settings)
    if resume and (folder / CHECKPOINT).exists():
        _restore(learner, folder / CHECKPOINT)
    rows = _kept_rows(folder, learner.decisions)
    while True:
        score = scores(held, by_network(learner.network), EVALUATION_SEED, EPISODES)
        row = {"steps": learner.decisions, "door_brier": float(score.mean())}
        if row["door_brier"] < min((one["door_brier"] for one in rows), default=np.inf):
            with placing(folder / BEST) as path:
                save_network(learner.network, path)
        append(folder / PROGRESS, row)
        rows.append(row)
        told.evaluated(row)
        if learner.decisions >= training.steps:
            return
        learner.segment(told.decisions)
        with placing(folder / CHECKPOINT) as path:
            save_arrays(learner.arrays(), path)


def save_arrays(arrays: dict[str, np.ndarray], path: Path) -> None:
    """Write arrays by name."""
    np.savez(path, allow_pickle=False, **arrays)


def _floors(training: ViewpointTraining, folder: Path, told: Reporter) -> tuple[Floors, Floors]:
    """The floors, from the folder if it has them."""
    path, total, done = folder / FLOORS, training.trained + training.held, 0

    def drawn() -> None:
        nonlocal done
        done += 1
        told.floors(done, total)

    if not path.exists():
        world, parts = find_world(training.world), {}
        for split, count in (("train", training.trained), ("validation", training.held)):
            floors = draw_floors(world, split, FIRST_FLOORS[split], count, drawn)
            if not len(floors.doors):
                raise InputError(f"no floor of the world {training.world} has a viewpoint of doors")
            parts |= {f"{split}/{name}": part for name, part in floors._asdict().items()}
        with placing(path) as made:
            save_arrays(parts, made)
    arrays = read_arrays(path, "the floors of a training")
    with guarded(path):
        try:
            both = [Floors(*(arrays[f"{split}/{name}"] for name in Floors._fields))
                    for split in ("train", "validation")]  # fmt: skip
        except KeyError as error:
            raise InputError(f"{path}: not the floors of a training ({error})") from None
    return both[0], both[1]


def _restore(learner: Learner, path: Path) -> None:
    arrays = read_arrays(path, "a checkpoint of viewpoints")
    with guarded(path):
        try:
            learner.restore(arrays)
        except (KeyError, TypeError, ValueError, RuntimeError) as error:
            raise InputError(
                f"{path}: not a checkpoint of viewpoints ({one_line(error)})"
            ) from None


def _kept_rows(folder: Path, decisions: int) -> list[dict[str, Any]]:
    """The evaluations before the checkpoint; later ones are removed, and made again."""
    path = folder / PROGRESS
    rows = [row for row in (read(path) if path.exists() else []) if row["steps"] < decisions]
    with replacing(path) as file:
        file.write("".join(json.dumps(row) + "\n" for row in rows).encode())
    return rows
