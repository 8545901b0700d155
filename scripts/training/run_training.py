"""The work of `dynslam train`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gymnasium.envs.registration import load_env_creator

import slam
from dynslam_env.patrol.config import PatrolConfig
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.patrol.goals import DoorPatrolGoalsEnv
from dynslam_env.patrol.vector import DoorPatrolVectorEnv
from dynslam_env.registration import spec_of
from dynslam_env.simulation.find_world import find_world
from slam.errors import InputError
from slam.validation import number, one_of, whole_number

from ..console.output import own_directory
from ..console.progress import progress_bar
from ..trials.jobs import file_name
from .interruption import interrupted
from .train import TrainCommand
from .worlds import LONG_PATROL, worlds_option

DEFAULT_SLAM, DEFAULT_WORKERS = "hmm-ml", 2
PATROLS = (DoorPatrolEnv, DoorPatrolVectorEnv, DoorPatrolGoalsEnv)


def run_training(command: TrainCommand) -> int:
    """Check the options, train with a progress bar, and say where the policy lies."""
    if command.env == LONG_PATROL:
        from .run_viewpoint_training import run_viewpoint_training

        return run_viewpoint_training(command)
    world = command.world or "corridor"
    try:
        from agents.training.settings import ALGORITHMS, read_settings
        from agents.training.train import Training, train
    except ImportError as error:
        raise InputError(f"training needs {error.name}: install dynslam[train]") from None
    system = DEFAULT_SLAM if command.slam is None else command.slam
    workers = DEFAULT_WORKERS if command.workers is None else command.workers
    one_of("algo", command.algo, ALGORITHMS)
    slam.make(system)
    find_world(world)
    whole_number("workers", workers, 1)
    _check_env(command.env)
    settings = read_settings(command.algo, command.env.rpartition(":")[2], command.hyperparameters)
    steps = _timesteps(settings) if command.steps is None else command.steps
    parameters: dict[str, Any] = {"world": world, "slam": system}
    if command.scan_every is not None:
        PatrolConfig(scan_every=command.scan_every)  # raises InputError for a wrong one
        parameters["scan_every"] = command.scan_every
    training = Training(command.env, command.algo, settings, command.seed, steps, parameters)
    name = f"{file_name(command.env)}-{file_name(world)}-{command.algo}-{command.seed}"
    out = own_directory(command.out or Path("out") / "train" / name)
    with progress_bar() as bar:
        task = bar.add_task("training", total=steps)

        def counted(count: int) -> None:
            bar.update(task, completed=min(count, steps))

        def report(row: dict[str, Any]) -> None:
            counted(row["steps"])
            bar.console.print(
                f"{row['steps']:>9,} steps  reward {row['reward']:.2f}  "
                f"Brier of doors {row['door_brier']:.3f}"
            )

        try:
            train(training, out, resume=command.resume, workers=workers, report=report,
                  counted=counted)  # fmt: skip
        except KeyboardInterrupt:
            return interrupted()
    print(f"look at {out}")
    if command.env == "DoorPatrol-v0":
        print(f"compare it: dynslam evaluate {out / 'best.zip'} lookout {worlds_option(world)}")
    return 0


def _check_env(name: str) -> None:
    """Raises InputError for an unknown environment, and for one that is no patrol."""
    spec = spec_of(name)
    made = spec.vector_entry_point or spec.entry_point
    if not _is_patrol(load_env_creator(made) if isinstance(made, str) else made):
        raise InputError(
            f"{name} is no patrol and has no SLAM to train with: use stable-baselines3 and "
            f"agents.vec_env.NativeVecEnv"
        )


def _is_patrol(made: Any) -> bool:
    return isinstance(made, type) and issubclass(made, PATROLS)


def _timesteps(settings: Mapping[str, Any]) -> int:
    steps = settings.get("n_timesteps", 1_000_000)
    number("n_timesteps", steps, 1)
    return int(steps)
