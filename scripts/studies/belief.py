"""`dynslam belief`: how well patrols know doors that they see, saw and never saw."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass
class BeliefCommand:
    """Compare two beliefs about doors on the same drives: `DynamicMap` and `BeliefMap`.

    The agents drive by the first; both get the same scans and poses. Writes results.jsonl, table.md
    and reliability.png.
    """

    worlds: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Registered worlds. Default: loop and office."""
    laws: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """fast (doors flip each 5 to 20 s) or slow (60 to 400 s). Default: both."""
    agents: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Classical agents. Default: lookout, longest-unseen, round-robin."""
    seeds: int = 30
    """Number of drives of each agent in each world, with each law."""
    first: int = 7500
    """The first seed; parameters were chosen on 900000 to 900003."""
    jobs: int = 2
    """Number of drives at the same time; -1: one per core."""
    out: Path | None = None
    """Directory to write to. Default: out/belief."""

    def __call__(self) -> int:
        """Run, write, print."""
        from .belief_study import study_beliefs

        return study_beliefs(self)
