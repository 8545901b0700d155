"""The work of `dynslam ghosts`: ghosts per metre of wall in every map of every drive."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agents import record_path
from dynslam_env.sensors.effects import Surfaces
from dynslam_env.sensors.laser import Laser
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.varied import Varied
from slam.benchmark.results import Result
from slam.benchmark.run import build, run
from slam.benchmark.statistics import median, share
from slam.errors import InputError
from slam.layers import layers
from slam.metrics.ghosts import Ghosts, seen_through
from slam.metrics.trajectory import alignment
from slam.validation import unknown_name, whole_number

from ..console.output import own_directory
from ..trials.pool import check_workers
from .drives import run_drives, write_table

if TYPE_CHECKING:
    from .ghosts import GhostsCommand

LAPS = (1, 3, 6, 12)  # around a block where people walk too: 80 s to 16 min
PLACES: dict[str, tuple[str, dict[str, Any]]] = {
    "corridor": ("DoorCorridor-v0", {}),
    "office": ("DoorOffice-v0", {}),
    "loop": ("DoorLoop-v0", {}),
    "crowd": ("DoorCrowd-v0", {}),
    **{
        f"rounds-{n}": (
            "DoorLoop-v0", {"world": Loop(laps=n, people=4), "max_episode_steps": 40_000}
        )
        for n in LAPS
    },
    **{
        f"furnished-{n}": (
            "DoorLoop-v0",
            {
                "world": Varied(Loop(laps=n, people=2), "hard"), "max_episode_steps": 40_000,
                "laser": Laser(effects=(Surfaces(glass=0.1),)),
            },
        )
        for n in LAPS
    },
}  # fmt: skip
BASELINE, VARIANTS = "static-ml", ("hmm-ml", "dynamic-graph")
HEADINGS = ("world", "map", "ghosts per m", "median: times fewer", "mean: times fewer",
        "no beam went through", "walls kept", "of walls hit, within 5 cm")  # fmt: skip


def count_ghosts(options: GhostsCommand) -> int:
    """Run, write, print; the exit status."""
    whole_number("seeds", options.seeds, 1)
    whole_number("first", options.first, 0)
    check_workers(options.jobs)
    for world in options.worlds:
        if world not in PLACES:
            raise InputError(unknown_name("world", world, PLACES))
    out = own_directory(options.out or Path("out") / "ghosts")
    seeds = range(options.first, options.first + options.seeds)
    tasks = [(world, seed) for world in options.worlds or PLACES for seed in seeds]
    rows, status = run_drives(drive, tasks, options.jobs, out, "ghosts")
    if rows:
        write_table(table(rows), out)
    return status


def drive(world: str, seed: int) -> list[Result]:
    """All maps of one drive."""
    env_id, parameters = PLACES[world]
    episode = record_path(env_id, seed, "moving", **parameters)
    assert episode.truth is not None
    scorer, truth = Ghosts(episode), episode.truth.poses
    done = run(build(BASELINE, episode, seed), episode)
    row: Result = {"world": world, "seed": seed}
    base = scorer.score(done.grid, alignment(done.poses, truth)).as_dict()
    rows = [{**row, "map": BASELINE, **base}]
    for variant in VARIANTS:
        done = run(build(variant, episode, seed), episode)
        made = layers(episode.scans, done.poses, believed=done.grid)
        frame = alignment(done.poses, truth)
        static = made.static_map()
        through = seen_through(episode, scorer.centres(static, frame))
        rows.append({
            **row,
            "map": f"layer, {variant}",
            **scorer.score(static, frame).as_dict(),
            "no_beam_through": int((through == 0).sum()),
        })  # fmt: skip
    return rows


def table(rows: list[Result]) -> str:
    """Markdown: medians with their intervals."""
    groups: dict[tuple[str, str], list[Result]] = {}
    for row in rows:
        groups.setdefault((row["world"], row["map"]), []).append(row)
    lines = [HEADINGS, ("---",) * len(HEADINGS)]
    lines += [_line(*key, group, groups[key[0], BASELINE]) for key, group in groups.items()]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _line(world: str, name: str, group: list[Result], base: list[Result]) -> tuple[str, ...]:
    cells = (_interval(median([row["ghosts_per_m"] for row in group])),)
    recalls = "wall_recall", "hit_recall"
    walls = [f"{np.median([row[name] for row in group]):.3f}" for name in recalls]
    if group is base:
        return (world, name, *cells, "-", "-", "-", *walls)
    return (world, name, *cells, _interval(_times_fewer(base, group, np.median), 1),
            _interval(_times_fewer(base, group, np.mean), 1),
            _share(group, "no_beam_through", "ghost_cells"), *walls)  # fmt: skip


def _times_fewer(
    base: list[Result], group: list[Result], centre: Any
) -> tuple[float, float, float]:
    """The ratio of two medians or means, with a paired bootstrap 95 % interval."""
    many, few = (np.array([row["ghosts_per_m"] for row in rows]) for rows in (base, group))
    drawn = np.random.default_rng(0).integers(len(many), size=(9999, len(many)))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = centre(many[drawn], axis=1) / centre(few[drawn], axis=1)
        value = float(centre(many) / centre(few))
    low, high = np.percentile(ratios, [2.5, 97.5], method="inverted_cdf")
    return value, float(low), float(high)


def _share(group: list[Result], part: str, whole: str) -> str:
    k, n = (sum(row[name] for row in group) for name in (part, whole))
    found = share([True] * k + [False] * (n - k))
    return f"{k} of {n} ({100 * found.low:.0f} to {100 * found.high:.0f} %)" if n else "-"


def _interval(figure: tuple[float, float, float], digits: int = 2) -> str:
    value, low, high = figure
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"
