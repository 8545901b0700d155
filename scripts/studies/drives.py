"""Drives of a study, run in parallel, and its files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed
from rich.console import Console

from slam.benchmark.results import Result, append
from slam.io.files import replacing

from ..console.exits import EXIT_INTERRUPTED
from ..console.progress import progress_bar


def run_drives(
    drive: Callable[..., list[Result]],
    tasks: Sequence[tuple[Any, ...]],
    jobs: int,
    out: Path,
    command: str,
) -> tuple[list[Result], int]:
    """The rows of `drive(*task)` for all tasks, and the exit status.

    Writes results.jsonl into `out` as rows come; `jobs` drives run at the same time. `command` of
    `dynslam` is for messages.
    """
    path, rows = out / "results.jsonl", []
    path.unlink(missing_ok=True)
    try:
        with progress_bar() as bar:
            work = Parallel(n_jobs=jobs, return_as="generator")
            done: Iterable[list[Result]] = work(delayed(drive)(*task) for task in tasks)  # pyright: ignore
            for found in bar.track(done, total=len(tasks), description=command):
                for row in found:
                    append(path, row)
                rows.extend(found)
    except KeyboardInterrupt:
        print(f"{command}: interrupted, {len(rows)} runs are kept", file=sys.stderr)
        return rows, EXIT_INTERRUPTED
    return rows, 0


def write_table(text: str, out: Path) -> None:
    """Write table.md into `out`, and print it."""
    with replacing(out / "table.md") as file:
        file.write(text.encode())
    Console().print(text, highlight=False, soft_wrap=True, markup=False)
