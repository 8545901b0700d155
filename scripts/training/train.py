"""`dynslam train`: learn a policy for a patrol."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass
class TrainCommand:
    """Train a policy by PPO; the same seed gives the same policy, interrupted or not.

    Writes progress.jsonl (a line per evaluation, on worlds held out from training), best.zip,
    checkpoint.zip and TensorBoard's files (best.npz and checkpoint.npz of viewpoints). `dynslam
    evaluate DIR/best.zip` compares the policy.
    """

    env: str = "DoorPatrol-v0"
    """Id of a patrol: DoorPatrol-v0, DoorPatrolGoals-v0, or MODULE:ID of your own, which MODULE
    registers (with --hyperparameters); or DoorPatrol-v1, where a policy chooses viewpoints: it
    learns on true poses, without a SLAM, by the viewpoint tables of floors of the world, and of
    --steps, --seed, --world, --out and --resume alone."""
    world: str | None = None
    """corridor, loop, office, crowd, any other registered world, a world file (.json), a ROS map
    (.yaml), or FILE.py:NAME of your own. Default: corridor; in DoorPatrol-v1 office."""
    slam: str | None = None
    """SLAM variant of the patrol. Default: hmm-ml. Not in DoorPatrol-v1."""
    scan_every: int | None = None
    """Control steps between two scans given to the SLAM: 1, 2 or 4 of the 4 of a decision; 4 is the
    cheapest. Default: 2. Not in DoorPatrol-v1."""
    algo: str = "ppo"
    """ppo or recurrent-ppo."""
    seed: int = 0
    """Seed of all random numbers."""
    steps: int | None = None
    """Steps of all environments together, rounded up to whole rollouts (in DoorPatrol-v1 to
    multiples of 163,840). Default: the hyperparameters' n_timesteps; in DoorPatrol-v1 5,000,000."""
    hyperparameters: Path | None = None
    """YAML as rl_zoo3 reads it; by default dynslam's own of the algorithm."""
    workers: int | None = None
    """Processes that share the environments; the policy does not depend on it. Default: 2. Not in
    DoorPatrol-v1."""
    out: Path | None = None
    """Directory to write to; by default out/train/ENV-WORLD-ALGO-SEED."""
    resume: bool = False
    """Continue the interrupted training in the directory."""

    def __call__(self) -> int:
        """Train."""
        from .run_training import run_training

        return run_training(self)
