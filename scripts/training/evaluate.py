"""`dynslam evaluate`: agents on the same patrols, with statistics, a page and films."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro

import agents
import slam
from slam.benchmark.results import Result
from slam.validation import number, whole_number

from ..console.exits import EXIT_MISTAKE
from ..console.output import output_directory
from ..console.progress import progress_bar
from ..console.selection import parse_selection
from ..figures.film import suffix
from ..report.summary import Wording
from ..report.write import write_report
from ..trials.batch import missing, run_batch
from ..trials.jobs import file_name
from ..trials.pool import check_workers, here
from ..trials.results import read_rows
from .patrol_jobs import SUITE, Patrol
from .registered import pack_registered
from .summary import print_summary
from .worlds import parse_worlds, steps_of


@dataclass
class EvaluateCommand:
    """Compare agents on the same patrols; write results.jsonl, report.html and films.

    Every episode is held out: no agent was tuned or trained on its seed.
    """

    agents: tyro.conf.Positional[tuple[str, ...]] = ("all",)
    """Names of agents, policies of `dynslam train` (best.zip), or FILE.py:NAME of your own; all:
    every registered agent. The others are compared with the first."""
    worlds: str = "corridor"
    """corridor, loop, office, crowd, any other registered world, a world file (.json), or
    FILE.py:NAME of your own, with commas between; all: every registered world."""
    slam: str = "hmm-ml"
    """SLAM variants, with commas between."""
    episodes: int = 100
    """Episodes of each agent in each world with each SLAM."""
    first: int = 7000
    """First seed; agents were tuned on 1000 to 1023 and 900000 on, and trained on others."""
    steps: int | None = None
    """Steps of 0.4 s of an episode; by default loop 500, office 750, any other world 250."""
    jobs: int = -1
    """Parallel episodes, each in a process of one thread; -1: one per core."""
    out: Path = Path("out/evaluate")
    """Directory to write to."""
    films: bool = True
    """Write a film of each agent in each world (the first SLAM, the first seed)."""
    resume: bool = False
    """Continue the evaluation in the directory: run only what is missing."""
    limit: float = 900.0
    """s, after which an episode is stopped."""

    def __call__(self) -> int:
        """Run, write, print."""
        names = self._names()
        patrols = self._patrols(names)
        out = output_directory(self.out)
        todo = missing(patrols, out / "results.jsonl", self.resume)
        status = run_batch(lambda _: here(todo, self.jobs), len(todo), out, "evaluate", "patrols")
        rows = read_rows(out / "results.jsonl") if (out / "results.jsonl").exists() else []
        if not rows:
            return status
        with progress_bar() as bar:
            pages = write_report(rows, out, names, Wording(SUITE, "agent"))
            for _ in bar.track(pages, total=None, description="report"):
                pass
        self._tell(rows, names, out)
        nothing = all(row["error"] is not None for row in rows)
        return EXIT_MISTAKE if nothing and not status else status

    def _names(self) -> list[str]:
        """The agents, each once; raises InputError for an unknown one."""
        asked = agents.names() if self.agents == ("all",) else list(dict.fromkeys(self.agents))
        for name in asked:
            agents.check(name)
        return asked

    def _patrols(self, names: list[str]) -> list[Patrol]:
        worlds = parse_worlds(self.worlds)
        systems = parse_selection("variant", self.slam, slam.variants())
        whole_number("episodes", self.episodes, 1)
        whole_number("first", self.first, 0)
        number("limit", self.limit, 1e-3)
        if self.steps is not None:
            whole_number("steps", self.steps, 1)
        check_workers(self.jobs)
        registered = pack_registered(names, worlds, systems)
        return [
            Patrol(
                world, system, name, seed, self.steps or steps_of(world), self.limit,
                pictured=seed == self.first, film=self._film(world, system, systems, name, seed),
                registered=registered,
            )
            for seed in range(self.first, self.first + self.episodes)
            for world in worlds
            for system in systems
            for name in names
        ]  # fmt: skip

    def _film(
        self, world: str, system: str, systems: list[str], name: str, seed: int
    ) -> Path | None:
        if not self.films or seed != self.first or system != systems[0]:
            return None
        return self.out / "films" / f"{file_name(name)}-{file_name(world)}{suffix()}"

    def _tell(self, rows: list[Result], names: list[str], out: Path) -> None:
        for row in [row for row in rows if row["error"] is not None][:5]:
            print(f"failed: {row['variant']}, seed {row['seed']}: {row['error']}", file=sys.stderr)
        print_summary(rows, names)
        print(f"{len(rows)} patrols; look at {out / 'report.html'}")
