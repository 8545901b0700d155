"""The work of `dynslam bench`: trials of a suite, their results and the report."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import Progress

from dynslam_env.reset_options import DIFFICULTIES
from dynslam_env.splits import SPLITS
from slam.benchmark.results import Result
from slam.errors import InputError
from slam.validation import number, one_of, unknown_name, whole_number

from ..console.output import own_directory
from ..console.progress import progress_bar
from ..report.lost import lost_terminal
from ..report.terminal import results_terminal
from ..report.write import write_report
from ..trials import cache
from ..trials.batch import missing, run_batch
from ..trials.jobs import Done, RecordEpisode, Trial
from ..trials.pool import check_workers, on_cluster, results_of
from ..trials.results import Condition, read_rows
from ..trials.sources import SimulatedDrive
from ..trials.worker_process import WorkerProcesses
from .run_weeks import NAME as WEEKS
from .run_weeks import run_weeks
from .suites import SUITES, Suite, logs, parse_variants
from .user_suite import read_suite

if TYPE_CHECKING:
    from .bench import BenchCommand

MAX_ERRORS_PRINTED = 5


def run_bench(options: BenchCommand) -> int:
    """Run, write, print; the exit status."""
    one_of("split", options.split, (None, *SPLITS))
    one_of("difficulty", options.difficulty, (None, *DIFFICULTIES))
    if options.suite == WEEKS:
        return run_weeks(options)
    if options.worlds is not None:
        raise InputError("--worlds is an option of the suite `weeks`")
    suite = _suite(options).at(options.split, options.difficulty)
    variants = parse_variants(options.variants or ",".join(suite.variants))
    seeds = suite.seeds if options.seeds is None else options.seeds
    whole_number("seeds", seeds, 1)
    first = options.first_seed
    whole_number("first", first, 0)
    number("limit", options.limit, 1e-3)
    check_workers(options.jobs)
    trials = suite.trials(variants, range(first, first + seeds), options.limit)
    out = own_directory(options.out or Path("out") / f"bench-{suite.name}")
    path = out / "results.jsonl"
    resume = options.resume or options.retry_failed
    todo = missing(trials, path, resume, options.retry_failed, options.mixed)
    status = run_batch(lambda bar: _results(options, todo, bar), len(todo), out, "bench", "runs")
    rows = read_rows(path) if path.exists() else []
    if not rows:
        return status
    with progress_bar() as bar:
        for _ in bar.track(write_report(rows, out, variants), total=None, description="report"):
            pass
    for table in (results_terminal(rows, variants), *lost_terminal(rows, variants)):
        Console().print(table)
    _print_outcome(rows, out)
    return status


def _suite(options: BenchCommand) -> Suite:
    if options.suite.endswith(".toml"):
        return read_suite(Path(options.suite))
    if options.suite not in (*SUITES, "logs"):
        known = (*SUITES, WEEKS, "logs", "or a file that ends with .toml")
        raise InputError(unknown_name("suite", options.suite, known))
    if options.suite == "logs":
        if options.logs is None:
            raise InputError("the suite `logs` needs a folder: --logs FOLDER")
        return logs(options.logs)
    return SUITES[options.suite]()


def _results(options: BenchCommand, todo: Sequence[Trial], bar: Progress) -> Iterator[Done]:
    """Results of the trials; here, their episodes are recorded first, by the same processes."""
    if options.cluster is not None:
        yield from on_cluster(todo, options.cluster)
        return
    recording = _recordings(todo)
    with WorkerProcesses() as processes:
        drives = results_of(recording, options.jobs, processes)
        for _ in bar.track(drives, len(recording), description="recording"):
            pass
        yield from results_of(todo, options.jobs, processes)
    cache.prune()


def _recordings(todo: Sequence[Trial]) -> list[RecordEpisode]:
    """One job per episode that is not in the cache."""
    drives = {t.source.key: t.source for t in todo if isinstance(t.source, SimulatedDrive)}
    limit = max((t.limit for t in todo), default=0.0)
    return [
        RecordEpisode(drive, limit)
        for drive in drives.values()
        if not cache.path_of(drive).exists()
    ]


def _print_outcome(rows: Sequence[Result], out: Path) -> None:
    errors = [row for row in rows if row["error"] is not None]
    for row in errors[:MAX_ERRORS_PRINTED]:
        where = f"{Condition.of(row)}, seed {row['seed']}"
        print(f"failed: {row['variant']}, {where}: {row['error']}", file=sys.stderr)
    if len(errors) > MAX_ERRORS_PRINTED:
        more = len(errors) - MAX_ERRORS_PRINTED
        print(f"and {more} more failed, see results.jsonl", file=sys.stderr)
    print(f"{len(rows)} runs, {len(errors)} without a result; look at {out / 'report.html'}")
