"""`dynslam train`: learn a policy for a patrol."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
from gymnasium.envs.registration import load_env_creator

import slam
from dynslam_env.patrol.goals import DoorPatrolGoalsEnv
from dynslam_env.patrol.vector import DoorPatrolVectorEnv
from dynslam_env.simulation.find_world import find_world
from slam.errors import InputError
from slam.validation import number, one_of, whole_number

from ..console.exits import EXIT_INTERRUPTED
from ..console.output import output_directory
from ..console.progress import progress_bar
from ..trials.jobs import file_name


@dataclass
class TrainCommand:
    """Train a policy by PPO; the same seed gives the same policy, interrupted or not.

    Writes progress.jsonl (a line per evaluation, on worlds held out from training), best.zip,
    checkpoint.zip and TensorBoard's files. `dynslam evaluate DIR/best.zip` compares the policy.
    """

    env: str = "DoorPatrol-v0"
    """Id of a patrol: DoorPatrol-v0, DoorPatrolGoals-v0, or one of your own."""
    world: str = "corridor"
    """corridor, loop, office, crowd, any other registered world, a world file (.json), or
    FILE.py:NAME of your own."""
    slam: str = "hmm-ml"
    """SLAM variant of the patrol."""
    algo: str = "ppo"
    """ppo or recurrent-ppo."""
    seed: int = 0
    """Seed of all random numbers."""
    steps: int | None = None
    """Steps of all environments together; by default the hyperparameters' n_timesteps."""
    hyperparameters: Path | None = None
    """YAML as rl_zoo3 reads it; by default dynslam's own of the algorithm."""
    workers: int = 2
    """Processes that share the environments; the policy does not depend on it."""
    out: Path | None = None
    """Directory to write to; by default out/train/ENV-WORLD-ALGO-SEED."""
    resume: bool = False
    """Continue the interrupted training in the directory."""

    def __call__(self) -> int:
        """Train."""
        try:
            from agents.training.settings import ALGORITHMS, read_settings
            from agents.training.train import Training, train
        except ImportError as error:
            raise InputError(f"training needs {error.name}: install dynslam[train]") from None
        one_of("algo", self.algo, ALGORITHMS)
        slam.make(self.slam)
        find_world(self.world)
        whole_number("workers", self.workers, 1)
        _check_env(self.env)
        settings = read_settings(self.algo, self.env, self.hyperparameters)
        steps = _timesteps(settings) if self.steps is None else self.steps
        parameters = {"world": self.world, "slam": self.slam}
        training = Training(self.env, self.algo, settings, self.seed, steps, parameters)
        name = f"{self.env}-{file_name(self.world)}-{self.algo}-{self.seed}"
        out = output_directory(self.out or Path("out") / "train" / name)
        with progress_bar() as bar:
            task = bar.add_task("training", total=steps)

            def report(row: dict[str, Any]) -> None:
                bar.update(task, completed=min(row["steps"], steps))
                bar.console.print(
                    f"{row['steps']:>9,} steps  reward {row['reward']:.2f}  "
                    f"Brier of doors {row['door_brier']:.3f}"
                )

            try:
                train(training, out, resume=self.resume, workers=self.workers, report=report)
            except KeyboardInterrupt:
                print(
                    "train: interrupted; the same command with --resume continues from the last "
                    "evaluation",
                    file=sys.stderr,
                )
                return EXIT_INTERRUPTED
        print(f"look at {out}")
        if self.env == "DoorPatrol-v0":
            print(f"compare it: dynslam evaluate {out / 'best.zip'} nearest-frontier")
        return 0


def _check_env(name: str) -> None:
    """Raises InputError for an unknown environment, and for one that is no patrol."""
    try:
        spec = gym.spec(name)
    except gym.error.Error as error:
        raise InputError(str(error)) from None
    made = spec.vector_entry_point or spec.entry_point
    if not _is_patrol(load_env_creator(made) if isinstance(made, str) else made):
        raise InputError(
            f"{name} is no patrol and has no SLAM to train with: use stable-baselines3 and "
            f"agents.vec_env.NativeVecEnv"
        )


def _is_patrol(made: Any) -> bool:
    return isinstance(made, type) and issubclass(made, (DoorPatrolVectorEnv, DoorPatrolGoalsEnv))


def _timesteps(settings: Mapping[str, Any]) -> int:
    steps = settings.get("n_timesteps", 1_000_000)
    number("n_timesteps", steps, 1)
    return int(steps)
