"""Resumable batches of jobs: each result is appended to results.jsonl as soon as it is there."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

from rich.progress import Progress

from slam.benchmark.results import Result, append
from slam.errors import InputError

from ..console.exits import EXIT_INTERRUPTED
from ..console.progress import progress_bar
from .jobs import Done, Job
from .recorded_run import save
from .results import Condition, read_rows

J = TypeVar("J", bound=Job)


def missing(jobs: Sequence[J], path: Path, resume: bool) -> list[J]:
    """The jobs without a row in the results file at `path`.

    Raises InputError if there is a file but no `resume`, and if its rows are of another suite or of
    other episodes than `jobs`: medians must not mix them.
    """
    if not path.exists():
        return list(jobs)
    if not resume:
        raise InputError(
            f"{path} holds earlier results: continue them with --resume, or choose another "
            f"directory with --out"
        )
    rows, planned = read_rows(path), [job.row() for job in jobs]
    _check_suites(rows, planned, path)
    _check_episodes(rows, planned, path)
    finished = {row["run"] for row in rows}
    return [job for job, row in zip(jobs, planned, strict=True) if row["run"] not in finished]


def _check_suites(rows: Sequence[Result], planned: Sequence[Result], path: Path) -> None:
    others = {str(row["suite"]) for row in rows} - {row["suite"] for row in planned}
    if others:
        raise InputError(
            f"{path} holds the suite {', '.join(sorted(others))}: choose another directory with "
            f"--out"
        )


def _check_episodes(rows: Sequence[Result], planned: Sequence[Result], path: Path) -> None:
    episodes = {(Condition.of(row), row["seed"]): row["episode"] for row in planned}
    for row in rows:
        condition, seed = Condition.of(row), row["seed"]
        if episodes.get((condition, seed), row["episode"]) != row["episode"]:
            raise InputError(
                f"{path} holds runs on another episode as {condition}, seed {seed}: the suite, a "
                f"log, the steps or the simulator were changed; choose another directory with --out"
            )


def run_batch(
    start: Callable[[Progress], Iterable[Done]], total: int, out: Path, command: str, noun: str
) -> int:
    """Write the results of `total` jobs into `out` as they come; the exit status.

    start    gives the results, and may show its own progress beside that of the batch
    command  of `dynslam`, for messages
    noun     what a job is called, in the plural
    """
    done = failed = 0
    try:
        with progress_bar() as bar:
            task = bar.add_task(f"{total} {noun}", total=total)
            for result in start(bar):
                keep(result, out)
                done += 1
                failed += result.row["error"] is not None
                failures = f", {failed} failed" if failed else ""
                bar.update(task, advance=1, description=f"{total} {noun}{failures}")
    except KeyboardInterrupt:
        print(
            f"{command}: interrupted, {done} of {total} {noun} are kept; the same command with "
            f"--resume continues",
            file=sys.stderr,
        )
        return EXIT_INTERRUPTED
    return 0


def keep(done: Done, out: Path) -> None:
    """Append a result to results.jsonl; save its recorded run, if any, in examples/."""
    if done.recorded is not None:
        save(done.recorded, out / "examples" / f"{done.row['run']}.npz")
    append(out / "results.jsonl", {**done.row, "finished": time.strftime("%Y-%m-%dT%H:%M:%S%z")})
