"""`dynslam doors`: how often what is found as a door is one, and how many doors are found."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass
class DoorsCommand:
    """Find doors in maps of simulated drives, and compare them with the true ones.

    Writes results.jsonl, table.md and reliability.png: the share of right ones by probability.
    """

    worlds: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """corridor, loop, crowd, office, rounds-1, rounds-3, corridor-hard, loop-hard or office-hard.
    Default: all."""
    laws: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """moving (doors flip each 5 to 20 s) or static. Default: both."""
    seeds: int = 6
    """Number of drives in each world, with each law."""
    first: int = 8200
    """The first seed; parameters were chosen on 1000 to 1003."""
    jobs: int = 2
    """Number of drives at the same time; -1: one per core."""
    out: Path | None = None
    """Directory to write to. Default: out/doors."""

    def __call__(self) -> int:
        """Run, write, print."""
        from .door_study import study_doors

        return study_doors(self)
