"""The work of `dynslam demo`: the trials, the table, the pictures."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from agents import record_corridor
from slam.algorithms.variants import BUILDERS
from slam.benchmark.results import Result, append
from slam.io.files import replacing
from slam.validation import whole_number

from ..bench.suites import paper
from ..console.exits import EXIT_INTERRUPTED
from ..console.output import own_directory
from ..console.progress import progress_bar
from ..console.selection import parse_variants
from ..trials.pool import check_workers, results_of
from ..trials.warm_up import warm_up_jobs
from ..trials.worker_process import WorkerProcesses
from .comparison import findings
from .pictures import write_pictures
from .table import markdown, terminal

if TYPE_CHECKING:
    from .demo import DemoCommand

PICTURED_SEED = 13  # of the pair in the pictures: in its figure 3 a door misleads static ML
TIME_LIMIT = 600.0  # s, of one run


def run_demo(options: DemoCommand) -> int:
    """Run, print, draw; the exit status."""
    whole_number("seeds", options.seeds, 1)
    check_workers(options.jobs)
    variants = parse_variants(options.variants)
    out = own_directory(options.out)
    results: list[Result] = []
    interrupted = False
    try:
        _measure(options, variants, out / "results.jsonl", results)
    except KeyboardInterrupt:
        print(
            f"demo: interrupted, {len(results)} runs are kept; no pictures are drawn",
            file=sys.stderr,
        )
        interrupted = True
    if not results:
        return EXIT_INTERRUPTED
    results.sort(
        key=lambda row: (variants.index(row["variant"]), row["seed"], row["doors"] != "static")
    )
    _report(results, out)
    if not interrupted:
        _draw(out)
    Console().print(f"written to {out}", highlight=False, soft_wrap=True)
    return EXIT_INTERRUPTED if interrupted else 0


def _measure(options: DemoCommand, variants: list[str], path: Path, results: list[Result]) -> None:
    """Compile all kernels, then run all trials; each result is appended to `path` and to `results`
    as it comes."""
    trials = paper().trials(variants, range(options.seeds), TIME_LIMIT)
    todo = [replace(trial, pictured=False) for trial in trials]  # no replays
    kernels = warm_up_jobs(["DoorCorridor-v0"], [name for name in variants if name in BUILDERS])
    with progress_bar() as progress, WorkerProcesses() as processes:
        compiled = results_of(kernels, options.jobs, processes)
        for _ in progress.track(compiled, len(kernels), description="compiling kernels"):
            pass
        runs = results_of(todo, options.jobs, processes)
        runs = progress.track(runs, len(todo), description="runs")
        for number, done in enumerate(runs):
            if number == 0:
                path.unlink(missing_ok=True)
            append(path, done.row)
            results.append(done.row)


def _report(results: list[Result], out: Path) -> None:
    pairs = len({row["seed"] for row in results})
    title = f"DoorCorridor-v0, {pairs} pairs of drives: medians, 95 % intervals"
    with replacing(out / "table.md") as file:
        file.write(f"{markdown(results)}\n```\n{findings(results)}\n```\n".encode())
    console = Console()
    console.print(terminal(results, title))
    console.print(f"\nPaired differences:\n{findings(results)}\n", highlight=False)


def _draw(out: Path) -> None:
    with progress_bar() as progress:
        static, moving = (record_corridor(PICTURED_SEED, doors) for doors in ("static", "moving"))
        pictures = write_pictures(static, moving, out)
        for _ in progress.track(pictures, total=None, description="drawing"):
            pass
