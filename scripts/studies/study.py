"""`dynslam study`: one thing varied at a time, on paired drives, with statistics."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass
class StudyCommand:
    """Run a study that varies one part of the SLAM or of the world at a time.

    Every case sees the drives of the same seeds. Writes results.jsonl and table.md.
    """

    name: tyro.conf.Positional[str]
    """models: every map model; accuracy: sources of the error; readings: sensor model x map;
    rates: how often doors move x map x beta; windows: the histogram's delta_t and bins; loops:
    particle filters and graphs, three laps of DoorLoop-v0; long: graphs on a loop of 210 m;
    covariance: whether errors are as large as claimed, in every world. All others: in
    DoorCorridor-v0."""
    seeds: int = 30
    """Number of drives."""
    first: int = 3000
    """The first seed; parameters were tuned on 1000 to 1023."""
    jobs: int = 2
    """Number of drives at the same time; -1: one per core."""
    out: Path | None = None
    """Directory to write to. Default: out/study-NAME."""

    def __call__(self) -> int:
        """Run, write, print."""
        from .study_runs import run_study

        return run_study(self)
