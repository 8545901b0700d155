"""The work of `dynslam bench weeks`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import slam
from slam.algorithms.variants import MAPS
from slam.errors import InputError
from slam.io.files import replacing
from slam.sessions.continuation import empty
from slam.validation import number, whole_number

from ..console.output import own_directory
from ..console.selection import LIST_VARIANTS, parse_selection
from ..trials.batch import missing, run_batch
from ..trials.code import code_of
from ..trials.jobs import Done
from ..trials.pool import check_workers, results_of
from ..trials.results import read_rows
from ..trials.worker_process import WorkerProcesses
from .suites import shipped
from .weeks import LAYERED, PLACES, WeeksTrial, slam_variant, world_name
from .weeks_page import weeks_page
from .weeks_table import markdown, weeks_tables

if TYPE_CHECKING:
    from .bench import BenchCommand

NAME, CAMPAIGNS = "weeks", 20
USUAL = (*(f"{name}-ml" for name in MAPS), LAYERED, "dynamic-graph")


def run_weeks(options: BenchCommand) -> int:
    """Run, write, print; the exit status."""
    known = [LAYERED, *slam.variants()]
    variants = parse_selection("variant", options.variants or ",".join(USUAL), known, LIST_VARIANTS)
    for name in variants:
        if name != LAYERED:
            empty(name)  # raises for a variant that continues no map
    seeds = CAMPAIGNS if options.seeds is None else options.seeds
    whole_number("seeds", seeds, 1)
    if options.split is not None or options.difficulty is not None:
        raise InputError("the suite `weeks` has campaigns: leave out --split, --difficulty")
    first = options.first_seed
    whole_number("first", first, 0)
    number("limit", options.limit, 1e-3)
    check_workers(options.jobs)
    if options.cluster is not None:
        raise InputError("the suite `weeks` runs on this machine: leave out --cluster")
    out = own_directory(options.out or Path("out") / f"bench-{NAME}")
    path = out / "results.jsonl"
    names = {world_name(env): env for env in PLACES}
    worlds = parse_selection("world", options.worlds or ",".join(names), list(names))
    envs = [names[world] for world in worlds]
    trials = _trials(envs, variants, range(first, first + seeds), options.limit)
    todo = missing(trials, path, options.resume, options.retry_failed, options.mixed)
    status = run_batch(lambda _: _results(options, todo), len(todo), out, "bench", "runs")
    if path.exists():
        _write(path, trials, variants, out)
    return status


def _trials(
    envs: Sequence[str], variants: Sequence[str], seeds: range, limit: float
) -> list[WeeksTrial]:
    """World by world and campaign by campaign, so that a bench that is stopped compares as many as
    it has."""
    builders = {name: shipped(slam_variant(name)) for name in variants}
    codes = {name: code_of(slam_variant(name))._asdict() for name in variants}
    return [
        WeeksTrial(env, name, seed, builders[name], limit, codes[name])
        for env in envs
        for seed in seeds
        for name in variants
    ]


def _results(options: BenchCommand, todo: Sequence[WeeksTrial]) -> Iterator[Done]:
    with WorkerProcesses() as processes:
        yield from results_of(todo, options.jobs, processes)


def _write(path: Path, trials: Sequence[WeeksTrial], variants: Sequence[str], out: Path) -> None:
    """Write table.md and report.html of the campaigns that are finished, and print the tables."""
    rows = read_rows(path)
    tables = weeks_tables(rows, variants)
    text = markdown(tables)
    for name, content in (("table.md", text), ("report.html", weeks_page(rows, tables, trials))):
        with replacing(out / name) as file:
            file.write(content.encode())
    print(text)
    failed = [row for row in rows if row["error"] is not None]
    for row in failed:
        print(f"failed: {row['variant']}, campaign {row['seed']}: {row['error']}")
    print(f"{len(rows)} runs, {len(failed)} without a result; look at {out / 'report.html'}")
