"""`dynslam demo`: the paper's experiment end to end, with its table, its pictures and a film."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

VARIANTS = "odometry,static-ml,clamped-ml,dynamic-ml,hmm-ml,static-ml/beta1,dynamic-ml/beta1"


@dataclass
class DemoCommand:
    """Run the paper's experiment: paired drives past static and moving doors.

    Every variant sees the same drives. Takes about a minute on two cores, and three quarters of a
    minute longer the first time, while kernels compile. Writes results.jsonl, table.md, the paper's
    figures as PNG, and replay.gif.
    """

    out: Path = Path("out/demo")
    """Directory to write to; results of an earlier demo there are replaced."""
    seeds: int = 30
    """Number of pairs of episodes."""
    jobs: int = 2
    """Number of runs at the same time; -1: one per core."""
    variants: str = VARIANTS
    """SLAM variants to compare, separated by commas; or all; or plain: those without a slash."""

    def __call__(self) -> int:
        """Run, print, draw."""
        from .run_demo import run_demo

        return run_demo(self)
