"""`dynslam ghosts`: ghosts in the static layer, and in static ML's map."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass
class GhostsCommand:
    """Count ghosts in maps: occupied cells where nothing permanent stands.

    Compares the map of static ML with the static layer at the poses of other variants, on the same
    drives with moving doors. Writes results.jsonl and table.md.
    """

    worlds: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """corridor, office, loop, crowd, rounds-1, -3, -6 or -12 (laps around a block with people),
    furnished-1, -3, -6 or -12 (with furniture, people and glass). Default: all."""
    seeds: int = 20
    """Number of drives in each world."""
    first: int = 8000
    """The first seed; the parameters of the layers were tuned on 1000 to 1005."""
    jobs: int = 2
    """Number of drives at the same time; -1: one per core."""
    out: Path | None = None
    """Directory to write to. Default: out/ghosts."""

    def __call__(self) -> int:
        """Run, write, print."""
        from .ghost_counts import count_ghosts

        return count_ghosts(self)
