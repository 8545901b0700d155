"""Resumable batches of jobs: each result is appended to results.jsonl as soon as it is there."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

from rich.progress import Progress

from slam.benchmark.results import Result, append
from slam.errors import InputError

from ..console.exits import EXIT_INTERRUPTED
from ..console.progress import progress_bar
from .code import Code
from .jobs import Done, Job
from .recorded_run import save
from .results import Condition, read_rows

J = TypeVar("J", bound=Job)


def missing(
    jobs: Sequence[J], path: Path, resume: bool, again: bool = False, mixed: bool = False
) -> list[J]:
    """The jobs without a row in the results file at `path`.

    again  whether a row without a result counts as none
    mixed  whether rows of other code may stay beside those of this

    Raises InputError if there is a file but no `resume`, and if its rows are of another suite, of
    other episodes than `jobs`, or of other code: medians must not mix them.
    """
    if not path.exists():
        return list(jobs)
    if not resume:
        raise InputError(
            f"{path} holds earlier results: go on with it by --resume, or choose another "
            f"directory by --out"
        )
    rows, planned = read_rows(path), [job.row() for job in jobs]
    _check_suites(rows, planned, path)
    _check_episodes(rows, planned, path)
    if not mixed:
        _check_code(rows, planned, path)
    finished = {row["run"] for row in rows if not (again and row["error"] is not None)}
    return [job for job, row in zip(jobs, planned, strict=True) if row["run"] not in finished]


def _check_suites(rows: Sequence[Result], planned: Sequence[Result], path: Path) -> None:
    others = {str(row["suite"]) for row in rows} - {row["suite"] for row in planned}
    if others:
        raise InputError(
            f"{path} holds the suite {', '.join(sorted(others))}: choose another directory by --out"
        )


def _check_episodes(rows: Sequence[Result], planned: Sequence[Result], path: Path) -> None:
    episodes = {(Condition.of(row), row["seed"]): row["episode"] for row in planned}
    for row in rows:
        condition, seed = Condition.of(row), row["seed"]
        if episodes.get((condition, seed), row["episode"]) != row["episode"]:
            raise InputError(
                f"{path} holds runs on another episode as {condition}, seed {seed}: the suite, a "
                f"log, the steps or the simulator were changed; choose another directory by --out"
            )


def _check_code(rows: Sequence[Result], planned: Sequence[Result], path: Path) -> None:
    """Of the variants that are to run: were their rows made by the same code?"""
    now = {row["variant"]: Code.of(row) for row in planned if "variant" in row}
    counts = Counter((row["variant"], Code.of(row)) for row in rows)
    others = [
        f"{variant}: {count} {'run' if count == 1 else 'runs'} of {code or 'unknown code'}, now "
        f"{now[variant]}"
        for (variant, code), count in counts.items()
        if variant in now and code != now[variant]
    ]
    if others:
        raise InputError(
            f"{path} would mix results of two codes ({'; '.join(others)}): go on all the same by "
            f"--mixed, or choose another directory by --out"
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
            f"--resume goes on",
            file=sys.stderr,
        )
        return EXIT_INTERRUPTED
    return 0


def keep(done: Done, out: Path) -> None:
    """Append a result to results.jsonl; save its recorded run, if any, in examples/."""
    if done.recorded is not None:
        save(done.recorded, out / "examples" / f"{done.row['run']}.npz")
    append(out / "results.jsonl", {**done.row, "finished": time.strftime("%Y-%m-%dT%H:%M:%S%z")})
