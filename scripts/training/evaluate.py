"""`dynslam evaluate`: agents on the same patrols, with statistics, a page and films."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

FIRST_SEED = 7000


@dataclass
class EvaluateCommand:
    """Compare agents on the same patrols; write results.jsonl, report.html and films.

    Every episode is held out: no agent was tuned or trained on its seed.
    """

    agents: tyro.conf.Positional[tuple[str, ...]] = ("all",)
    """Names of agents, policies of `dynslam train` (best.zip, best.npz) or of stable-baselines3
    (PPO with MultiInputPolicy, .zip), or FILE.py:NAME of your own; all: every registered agent.
    The others are compared with the first."""
    env: str = "DoorPatrol-v0"
    """DoorPatrol-v0: doors of 5 to 20 s. DoorPatrol-v1: doors of 60 to 400 s with habits, episodes
    of 600 s, and questions of the way, whose regret in s is scored too."""
    worlds: str = "corridor"
    """corridor, loop, office, crowd, any other registered world, a world file (.json), a ROS map
    (.yaml), or FILE.py:NAME of your own, with commas between; all: every registered world."""
    slam: str = "hmm-ml"
    """SLAM variants, with commas between."""
    episodes: int = 100
    """Episodes of each agent in each world with each SLAM."""
    first: int | None = None
    """First seed; agents were tuned on 1000 to 1023 and 900000 on, and trained on others. With
    --split, the first episode there. Default: 7000; with --split, 0."""
    split: str | None = None
    """train, validation or test: the episodes of this split, which are the same for everybody."""
    difficulty: str | None = None
    """easy, medium or hard, of dynslam's own worlds. Default: the worlds as they are."""
    steps: int | None = None
    """Steps of 0.4 s of an episode; by default loop 500, office 750, any other world 250;
    in DoorPatrol-v1 1500 (600 s), and up to 4500 for half an hour."""
    jobs: int = -1
    """Parallel episodes, each in a process of one thread; -1: one per core."""
    out: Path = Path("out/evaluate")
    """Directory to write to."""
    films: bool = True
    """Film the best and the worst episode of each agent in each world, by the doors, with the
    first SLAM; they are driven once more for it."""
    resume: bool = False
    """Continue the evaluation in the directory: run only what is missing."""
    limit: float = 900.0
    """s, after which an episode is stopped."""

    @property
    def begin(self) -> int:
        """The first seed, or the number of the first episode of the split."""
        if self.first is not None:
            return self.first
        return FIRST_SEED if self.split is None else 0

    def __call__(self) -> int:
        """Run, write, print."""
        from .run_evaluation import run_evaluation

        return run_evaluation(self)
