"""The work of `dynslam train --env DoorPatrol-v1`: a policy that chooses viewpoints."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.progress import Progress

from dynslam_env.simulation.find_world import find_world
from slam.errors import InputError
from slam.validation import whole_number

from ..console.output import own_directory
from ..console.progress import progress_bar
from ..trials.jobs import file_name
from .interruption import interrupted
from .train import TrainCommand
from .worlds import LONG_PATROL, worlds_option

DEFAULT_STEPS = 5_000_000  # decisions


def run_viewpoint_training(command: TrainCommand) -> int:
    """Draw the floors, learn by PPO in the fast setting, and keep the best policy."""
    try:
        from agents.viewpoints.train import Reporter, ViewpointTraining, train
    except ImportError as error:
        raise InputError(f"training needs {error.name}: install dynslam[train]") from None
    if command.hyperparameters is not None or command.algo != "ppo":
        raise InputError(f"--env {LONG_PATROL} has one algorithm, and no --hyperparameters")
    for option in ("slam", "scan_every", "workers"):
        if getattr(command, option) is not None:
            name = option.replace("_", "-")
            raise InputError(f"--env {LONG_PATROL} learns without a SLAM, and has no --{name}")
    name, steps = command.world or "office", command.steps or DEFAULT_STEPS
    find_world(name)
    whole_number("steps", DEFAULT_STEPS if command.steps is None else command.steps, 1)
    whole_number("seed", command.seed, 0)
    folder = f"{LONG_PATROL}-{file_name(name)}-viewpoints-{command.seed}"
    out = own_directory(command.out or Path("out") / "train" / folder)

    class Shown(Reporter):
        """Shows how it goes on."""

        def __init__(self, bar: Progress):
            self._bar = bar
            self._drawn = bar.add_task("compiling kernels, or loading them", total=None)
            self._learned = bar.add_task("training", total=steps, start=False)

        def floors(self, count: int, total: int) -> None:
            self._bar.update(
                self._drawn, description="drawing floors", completed=count, total=total
            )

        def decisions(self, count: int) -> None:
            self._bar.update(self._learned, completed=min(count, steps))

        def evaluated(self, row: dict[str, Any]) -> None:
            self._bar.update(self._drawn, visible=False, total=0)
            if not self._bar.tasks[1].started:
                self._bar.reset(self._learned, completed=min(row["steps"], steps))
            self._bar.console.print(
                f"{row['steps']:>9,} decisions  Brier of doors {row['door_brier']:.4f}"
            )

    with progress_bar() as bar:
        try:
            train(ViewpointTraining(name, command.seed, steps), out, command.resume, Shown(bar))
        except KeyboardInterrupt:
            return interrupted()
    print(f"compare it: dynslam evaluate {out / 'best.npz'} greedy --env {LONG_PATROL} "
          f"{worlds_option(name)}")  # fmt: skip
    return 0
