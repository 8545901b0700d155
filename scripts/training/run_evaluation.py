"""The work of `dynslam evaluate`."""

from __future__ import annotations

import sys
from pathlib import Path

import agents
import slam
from dynslam_env.reset_options import DIFFICULTIES
from dynslam_env.splits import SPLITS
from slam.benchmark.results import Result
from slam.validation import number, one_of, whole_number

from ..console.exits import EXIT_MISTAKE
from ..console.output import own_directory
from ..console.progress import progress_bar
from ..console.selection import LIST_VARIANTS, parse_selection
from ..figures.film import suffix
from ..report.summary import Wording
from ..report.write import write_report
from ..trials.batch import missing, run_batch
from ..trials.jobs import file_name
from ..trials.pool import check_workers, here
from ..trials.results import read_rows
from .evaluate import EvaluateCommand
from .patrol_jobs import SUITE, Patrol
from .registered import pack_registered
from .summary import print_summary
from .worlds import PATROL_ENVS, parse_worlds, steps_of


def run_evaluation(command: EvaluateCommand) -> int:
    """Run what is missing, write the results, the page and the films, print the summary."""
    names = agent_names(command)
    patrols = patrols_of(command, names)
    out = own_directory(command.out)
    todo = missing(patrols, out / "results.jsonl", command.resume)
    status = run_batch(lambda _: here(todo, command.jobs), len(todo), out, "evaluate", "patrols")
    rows = read_rows(out / "results.jsonl") if (out / "results.jsonl").exists() else []
    if not rows:
        return status
    with progress_bar() as bar:
        pages = write_report(rows, out, names, Wording(SUITE, "agent"))
        for _ in bar.track(pages, total=None, description="report"):
            pass
    _print(rows, names, out)
    nothing = all(row["error"] is not None for row in rows)
    return EXIT_MISTAKE if nothing and not status else status


def agent_names(command: EvaluateCommand) -> list[str]:
    """The agents, each once; raises InputError for an unknown one."""
    asked = agents.names() if command.agents == ("all",) else list(dict.fromkeys(command.agents))
    for name in asked:
        agents.check(name)
    return asked


def patrols_of(command: EvaluateCommand, names: list[str]) -> list[Patrol]:
    """One patrol per seed, world, SLAM and agent; raises InputError for wrong options."""
    one_of("env", command.env, PATROL_ENVS)
    worlds = parse_worlds(command.worlds)
    systems = parse_selection("variant", command.slam, slam.variants(), LIST_VARIANTS)
    whole_number("episodes", command.episodes, 1)
    whole_number("first", command.begin, 0)
    number("limit", command.limit, 1e-3)
    one_of("split", command.split, (None, *SPLITS))
    one_of("difficulty", command.difficulty, (None, *DIFFICULTIES))
    if command.steps is not None:
        whole_number("steps", command.steps, 1)
    check_workers(command.jobs)
    registered = pack_registered(names, worlds, systems)
    return [
        Patrol(
            world, system, name, seed, command.steps or steps_of(world, command.env),
            command.limit, pictured=seed == command.begin,
            film=_film(command, world, system, systems, name, seed), registered=registered,
            split=command.split, difficulty=command.difficulty, env=command.env,
        )
        for seed in range(command.begin, command.begin + command.episodes)
        for world in worlds
        for system in systems
        for name in names
    ]  # fmt: skip


def _film(
    command: EvaluateCommand, world: str, system: str, systems: list[str], name: str, seed: int
) -> Path | None:
    if not command.films or seed != command.begin or system != systems[0]:
        return None
    return command.out / "films" / f"{file_name(name)}-{file_name(world)}{suffix()}"


def _print(rows: list[Result], names: list[str], out: Path) -> None:
    for row in [row for row in rows if row["error"] is not None][:5]:
        print(f"failed: {row['variant']}, seed {row['seed']}: {row['error']}", file=sys.stderr)
    print_summary(rows, names)
    print(f"{len(rows)} patrols; look at {out / 'report.html'}")
