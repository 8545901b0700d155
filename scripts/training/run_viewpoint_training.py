"""The work of `dynslam train --env DoorPatrol-v1`: a policy that chooses viewpoints.

In the fast setting (`agents.viewpoints.fast_patrols`), from a network that begins near `Greedy`.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

from dynslam_env.simulation.find_world import find_world
from slam.errors import InputError
from slam.validation import whole_number

from ..console.output import own_directory
from ..console.progress import progress_bar
from ..trials.jobs import file_name
from .train import TrainCommand
from .worlds import LONG_PATROL

DEFAULT_STEPS = 1_000_000  # decisions
TRAINED_FLOORS, HELD_OUT_FLOORS = 140, 40  # of the splits train and validation
EVALUATION_UPDATES = 15  # updates of the policy between two evaluations
EVALUATION_SEED = 1


def run_viewpoint_training(command: TrainCommand) -> int:
    """Draw the floors, learn by PPO, and keep the best policy.

    Writes progress.jsonl, a line an evaluation: `steps` (decisions), `door_brier` on held-out
    floors in the fast setting, and `per_second`.
    """
    try:
        from agents.viewpoints.learned import save_network
        from agents.viewpoints.ppo import Learner, by_network, scores
    except ImportError as error:
        raise InputError(f"training needs {error.name}: install dynslam[train]") from None
    from agents.viewpoints.floors import draw_floors

    if command.resume or command.hyperparameters is not None:
        raise InputError(f"--env {LONG_PATROL} knows neither --resume nor --hyperparameters")
    name = command.world or "office"
    world, steps = find_world(name), command.steps or DEFAULT_STEPS
    whole_number("steps", steps, 1)
    folder = f"{LONG_PATROL}-{file_name(name)}-viewpoints-{command.seed}"
    out = own_directory(command.out or Path("out") / "train" / folder)
    out.mkdir(parents=True, exist_ok=True)
    print("drawing floors ...", flush=True)
    trained = draw_floors(world, "train", 0, TRAINED_FLOORS)
    held_out = draw_floors(world, "validation", 0, HELD_OUT_FLOORS)
    learner = Learner(trained, command.seed, steps)
    best, updates, begun = float("inf"), 0, time.monotonic()
    with progress_bar() as bar, (out / "progress.jsonl").open("w") as lines:
        task = bar.add_task("training", total=steps)
        while True:
            over = learner.decisions >= steps
            if updates % EVALUATION_UPDATES == 0 or over:
                found = scores(held_out, by_network(learner.network), EVALUATION_SEED)
                rate = learner.decisions / (time.monotonic() - begun)
                row = {"steps": learner.decisions, "door_brier": float(found.mean()),
                       "per_second": rate}  # fmt: skip
                print(json.dumps(row), file=lines, flush=True)
                bar.console.print(f"{learner.decisions:>9,} decisions  {rate:5.0f} a second  "
                                  f"Brier of doors {row['door_brier']:.4f}")  # fmt: skip
                if row["door_brier"] < best:
                    best = row["door_brier"]
                    save_network(learner.network, out / "best.npz")
            if over:
                break
            learner.update()
            updates += 1
            bar.update(task, completed=min(learner.decisions, steps))
    print(f"compare it: dynslam evaluate {out / 'best.npz'} greedy --env {LONG_PATROL} "
          "--worlds office --split test")  # fmt: skip
    return 0
