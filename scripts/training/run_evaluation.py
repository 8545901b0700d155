"""The work of `dynslam evaluate`."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import agents
import slam
from dynslam_env.reset_options import DIFFICULTIES
from dynslam_env.splits import SPLITS
from slam.benchmark.results import Result
from slam.errors import InputError
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
        if command.films and not status:
            films = films_of(patrols, rows, out / "films")
            todo = [patrol for patrol in films if patrol.film and not patrol.film.exists()]
            for done in bar.track(here(todo, command.jobs), total=len(todo), description="films"):
                if done.row["error"] is not None:
                    print(f"no film: {done.row['error']}", file=sys.stderr)
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
    if command.env not in PATROL_ENVS:
        raise InputError(
            f"agents are compared in {' and '.join(PATROL_ENVS)}, got {command.env}; a place of "
            f"your own is --worlds FILE.py:NAME"
        )
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
            registered=registered, split=command.split, difficulty=command.difficulty,
            env=command.env,
        )
        for seed in range(command.begin, command.begin + command.episodes)
        for world in worlds
        for system in systems
        for name in names
    ]  # fmt: skip


def films_of(patrols: list[Patrol], rows: list[Result], folder: Path) -> list[Patrol]:
    """The patrols to film: of each agent in each world, the ones with the best and the worst Brier
    score of the doors, with the first SLAM."""
    by_name, films = {patrol.name: patrol for patrol in patrols}, []
    scored: dict[tuple[str, str], list[tuple[float, int, Patrol]]] = {}
    for row in rows:
        patrol = by_name.get(row["run"])
        if patrol and patrol.slam == patrols[0].slam and row.get("door_brier") is not None:
            of_agent = scored.setdefault((patrol.agent, patrol.world), [])
            of_agent.append((row["door_brier"], patrol.seed, patrol))
    for (agent, world), found in scored.items():
        stem = f"{file_name(agent)}-{file_name(world)}"
        picked = {"best": min(found)} | ({"worst": max(found)} if len(found) > 1 else {})
        for which, (_, seed, patrol) in picked.items():
            path = folder / f"{stem}-{which}-{seed}{suffix()}"
            films.append(replace(patrol, film=path, pictured=False))
    return films


def _print(rows: list[Result], names: list[str], out: Path) -> None:
    for row in [row for row in rows if row["error"] is not None][:5]:
        print(f"failed: {row['variant']}, seed {row['seed']}: {row['error']}", file=sys.stderr)
    print_summary(rows, names)
    print(f"{len(rows)} patrols; look at {out / 'report.html'}")
