"""`dynslam bench`: SLAM variants on the same episodes, with statistics and a report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

FIRST_SEED = 5000


@dataclass
class BenchCommand:
    """Run SLAM variants on the same episodes and write scores, statistics and a report.

    Writes results.jsonl, results.csv and report.html. Each finished run is appended to
    results.jsonl at once: --resume continues a bench that was stopped. A variant that fails or
    hangs is reported as failed and does not stop the others.
    """

    suite: tyro.conf.Positional[str]
    """paper: the paper's experiment; change: how much change each variant stands; worlds: all
    environments; faults: wheels that slip, a laser that lags, and others, and whether a variant
    knows that it is lost; sensors: lasers and robots as they are, an effect at a time; weeks: map
    a building, come back on later days, one campaign a seed (also writes table.md); logs: a
    folder of recorded logs (--logs); or a TOML file of your own."""
    variants: str | None = None
    """SLAM variants, separated by commas, or all. Default: those of the suite. The others are
    compared with the first."""
    seeds: int | None = None
    """Number of episodes per condition. Default: that of the suite."""
    first: int | None = None
    """The first seed, or with --split the number of the first episode. Default: 5000 (parameters
    were tuned on 1000 to 1023); with --split, 0."""
    split: str | None = None
    """train, validation or test: the episodes of this split, which are the same for everybody."""
    difficulty: str | None = None
    """easy, medium or hard: the worlds are drawn anew for each episode."""
    worlds: str | None = None
    """Of the suite weeks: corridor or office. Default: both."""
    jobs: int = -1
    """Number of runs at the same time, each a process of one thread; -1: one per core."""
    out: Path | None = None
    """Directory to write to. Default: out/bench-SUITE."""
    logs: Path | None = None
    """The folder of the suite `logs`."""
    cluster: str | None = None
    """Address of a Dask scheduler, such as tcp://host:8786, whose workers do the runs."""
    resume: bool = False
    """Continue the results in the directory: only missing runs are done."""
    retry_failed: bool = False
    """--resume, and runs without a result are tried again."""
    mixed: bool = False
    """With --resume: go on although the code of a variant has changed since its first runs."""
    limit: float = 600.0
    """Time limit of a run in s, with its scores and pictures; a longer one counts as failed."""

    @property
    def first_seed(self) -> int:
        """The first seed, or the number of the first episode of the split."""
        if self.first is not None:
            return self.first
        return FIRST_SEED if self.split is None else 0

    def __call__(self) -> int:
        """Run, write, print."""
        from .run_bench import run_bench

        return run_bench(self)
