"""`dynslam bench`: SLAM variants on the same episodes, with statistics and a page to look at."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

import tyro

from slam.benchmark.results import Result, append
from slam.errors import InputError
from slam.validation import number, one_of, whole_number

from ..console.exits import EXIT_INTERRUPTED
from ..console.output import output_directory
from ..console.progress import progress_bar
from ..console.selection import parse_selection
from ..report.summary import Condition, read_rows
from ..report.write import write_report
from ..trials import cache
from ..trials.example import save
from ..trials.jobs import Done, RecordEpisode, Trial
from ..trials.pool import check_workers, here, on_cluster
from ..trials.sources import SimulatedDrive
from .suites import SUITES, Suite, known_variants, logs
from .user_suite import read_suite


@dataclass
class BenchCommand:
    """Run SLAM variants on the same episodes; write results.jsonl, results.csv and report.html.

    Every finished run is one line of results.jsonl, at once: a bench that was killed goes on with
    --resume. A variant that fails or hangs is told as failed, and stops nothing else.
    """

    suite: tyro.conf.Positional[str]
    """paper: the paper's experiment; change: where does which variant break; worlds: all
    environments; logs: a folder of recorded logs (--logs); or a TOML file of your own."""
    variants: str | None = None
    """SLAM variants, with commas between, or all; if none are named, those of the suite. The first
    is what the others are compared with."""
    seeds: int | None = None
    """Number of episodes under each condition; if none is given, the suite's own."""
    first: int = 5000
    """The first seed; parameters were chosen on 1000 to 1023."""
    jobs: int = -1
    """Runs at the same time, each in a process of one thread; -1: one a core."""
    out: Path | None = None
    """Directory to write to; if none is given, out/bench-SUITE."""
    logs: Path | None = None
    """The folder of the suite `logs`."""
    cluster: str | None = None
    """Address of a Dask scheduler, such as tcp://host:8786: its workers do the runs."""
    resume: bool = False
    """Go on with what is in the directory: only what is missing is run."""
    limit: float = 600.0
    """s, after which a run counts as hanging; its scores and its pictures are in that time."""

    def __call__(self) -> int:
        """Run, write, print."""
        suite = self._suite()
        chosen_ones = parse_selection(
            "variant", self.variants or ",".join(suite.variants), known_variants()
        )
        seeds = suite.seeds if self.seeds is None else self.seeds
        whole_number("seeds", seeds, 1)
        whole_number("first", self.first, 0)
        number("limit", self.limit, 1e-3)
        check_workers(self.jobs)
        trials = suite.trials(chosen_ones, range(self.first, self.first + seeds), self.limit)
        out = output_directory(self.out or Path("out") / f"bench-{suite.name}")
        todo = self._missing(trials, out / "results.jsonl")
        status = self._run(todo, out)
        rows = read_rows(out / "results.jsonl") if (out / "results.jsonl").exists() else []
        if not rows:
            return status
        with progress_bar() as bar:
            for _ in bar.track(
                write_report(rows, out, chosen_ones), total=None, description="report"
            ):
                pass
        self._tell(rows, out)
        return status

    def _suite(self) -> Suite:
        if self.suite.endswith(".toml"):
            return read_suite(Path(self.suite))
        one_of("suite", self.suite, (*SUITES, "logs", "a file that ends with .toml"))
        if self.suite == "logs":
            if self.logs is None:
                raise InputError("the suite `logs` needs a folder: --logs FOLDER")
            return logs(self.logs)
        return SUITES[self.suite]()

    def _missing(self, trials: Sequence[Trial], path: Path) -> list[Trial]:
        """What is not in the results yet; an earlier bench's are refused but for --resume."""
        if not path.exists():
            return list(trials)
        if not self.resume:
            raise InputError(
                f"{path} holds the results of an earlier bench: go on with it by --resume, or "
                f"choose another directory by --out"
            )
        rows = read_rows(path)
        wanted = {(Condition.named(t.condition), t.source.seed): t.source.key for t in trials}
        check_episodes(rows, {trial.suite for trial in trials}, wanted, path)
        there = {row["run"] for row in rows}
        return [trial for trial in trials if trial.name not in there]

    def _run(self, todo: Sequence[Trial], out: Path) -> int:
        """Everything that is to do, each result written as it comes; the exit status."""
        done = 0
        try:
            with progress_bar() as bar:
                if self.cluster is None:
                    recording = _recordings(todo)
                    if recording:
                        output_directory(cache.folder())
                    drives = here(recording, self.jobs)
                    for _ in bar.track(drives, len(recording), description="recording"):
                        pass
                task = bar.add_task(f"{len(todo)} runs", total=len(todo))
                failed = 0
                for result in self._results(todo):
                    keep(result, out)
                    done += 1
                    failed += result.row["error"] is not None
                    bar.update(task, advance=1, description=_progress(len(todo), failed))
                if self.cluster is None:
                    cache.prune()
        except KeyboardInterrupt:
            print(
                f"bench: interrupted, {done} of {len(todo)} runs are kept; the same command with "
                f"--resume goes on",
                file=sys.stderr,
            )
            return EXIT_INTERRUPTED
        return 0

    def _results(self, todo: Sequence[Trial]) -> Iterator[Done]:
        return here(todo, self.jobs) if self.cluster is None else on_cluster(todo, self.cluster)

    def _tell(self, rows: Sequence[Result], out: Path) -> None:
        errors = [row for row in rows if row["error"] is not None]
        for row in errors[:5]:
            where = f"{Condition.of(row)}, seed {row['seed']}"
            print(f"failed: {row['variant']}, {where}: {row['error']}", file=sys.stderr)
        if len(errors) > 5:
            print(f"and {len(errors) - 5} more failed, see results.jsonl", file=sys.stderr)
        print(f"{len(rows)} runs, {len(errors)} without a result; look at {out / 'report.html'}")


def keep(done: Done, out: Path) -> None:
    """Append a result, and keep the run that is to be looked at beside it."""
    if done.example is not None:
        save(done.example, out / "examples" / f"{done.row['run']}.npz")
    append(out / "results.jsonl", {**done.row, "finished": time.strftime("%Y-%m-%dT%H:%M:%S%z")})


def check_episodes(
    rows: Sequence[Result],
    suites: Set[str],
    wanted: Mapping[tuple[Condition, int], str],
    path: Path,
) -> None:
    """What is there is of the same suites, and of the same episodes as what is to come: medians
    must not mix them.

    wanted  episode by condition and seed
    """
    others = {str(row["suite"]) for row in rows} - suites
    if others:
        raise InputError(
            f"{path} holds the suite {', '.join(sorted(others))}: choose another directory by --out"
        )
    for row in rows:
        condition, seed = Condition.of(row), row["seed"]
        if wanted.get((condition, seed), row["episode"]) != row["episode"]:
            raise InputError(
                f"{path} holds runs on another episode as {condition}, seed {seed}: the suite, a "
                f"log, the steps or the simulator were changed; choose another directory by --out"
            )


def _recordings(todo: Sequence[Trial]) -> list[RecordEpisode]:
    """What is not in the cache, each once."""
    drives = {t.source.key: t.source for t in todo if isinstance(t.source, SimulatedDrive)}
    limit = max((t.limit for t in todo), default=0.0)
    return [
        RecordEpisode(drive, limit)
        for drive in drives.values()
        if not cache.path_of(drive).exists()
    ]


def _progress(total: int, failed: int) -> str:
    return f"{total} runs" + (f", {failed} failed" if failed else "")
