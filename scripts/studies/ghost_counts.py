"""The work of `dynslam ghosts`: ghosts per metre of wall in every map of every drive."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from agents import record_path
from dynslam_env import DoorWorldEnv
from dynslam_env.worlds.loop import Loop
from slam.benchmark.results import Result
from slam.benchmark.run import build, run
from slam.benchmark.statistics import median, share
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2, transform_points
from slam.layers import Layers, layers
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
}  # fmt: skip
BASELINE, VARIANTS = "static-ml", ("hmm-ml", "dynamic-graph")
MAX_DOOR_ERROR = 0.35  # m between the middles of a found and the true door
MIN_SIGHTINGS = 5  # scans that saw a door closed, and as many that saw it open: it can be found
MAX_LEAF_DISTANCE = 0.08  # m of an echo from the middle of the closed leaf
HEADINGS = ("world", "map", "ghosts per m", "median: times fewer", "mean: times fewer",
        "no beam went through", "walls kept", "doors: right", "perhaps: right",
        "doors seen open and closed: found")  # fmt: skip


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
    middles = true_doors(world, seed)
    known = seen_both(episode, middles)
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
            **_doors(made, frame, middles, known),
        })  # fmt: skip
    return rows


def true_doors(world: str, seed: int) -> Array:
    """(d, 2) middles of the closed door leaves, m."""
    env_id, parameters = PLACES[world]
    env = gym.make(f"dynslam_env:{env_id}", doors="moving", **parameters)
    env.reset(seed=seed)
    place = env.unwrapped
    assert isinstance(place, DoorWorldEnv)
    doors = place.layout.doors
    half = [0.5 * d.width * np.array([np.cos(d.closed), np.sin(d.closed)]) for d in doors]
    return np.array([d.hinge for d in doors]).reshape(-1, 2) + np.array(half).reshape(-1, 2)


def seen_both(episode: Episode, middles: Array) -> np.ndarray:
    """(d,) bool: MIN_SIGHTINGS scans saw the middle of the doorway closed, and as many open."""
    assert episode.truth is not None
    closed = np.zeros(len(middles), np.int64)
    for scan, pose in zip(episode.scans, episode.truth.poses.tolist(), strict=True):
        echoes = transform_points(Pose2(*pose), scan.points)
        away = np.hypot(*(echoes[:, None] - middles).T)
        closed += (away < MAX_LEAF_DISTANCE).any(axis=1)
    return (closed >= MIN_SIGHTINGS) & (seen_through(episode, middles) >= MIN_SIGHTINGS)


def _doors(made: Layers, frame: Pose2, middles: Array, known: np.ndarray) -> Result:
    """Of the doors that are called so, and of all that are listed: how many are doors; and of those
    that were seen open and closed: how many were called so."""
    found = [transform_points(frame, door.ends).mean(axis=0) for door in made.doors]
    away = np.hypot(*(np.array(found).reshape(-1, 1, 2) - middles).transpose(2, 0, 1))
    right, sure = (away < MAX_DOOR_ERROR).any(axis=1), np.array([d.sure for d in made.doors], bool)
    at_sure = (away[sure] < MAX_DOOR_ERROR).any(axis=0)
    return {
        "doors_found": int(sure.sum()),
        "doors_right": int((right & sure).sum()),
        "doors_perhaps": int((~sure).sum()),
        "doors_perhaps_right": int((right & ~sure).sum()),
        "doors_known": int(known.sum()),
        "doors_known_found": int((at_sure & known).sum()),
    }


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
    walls = f"{np.median([row['wall_recall'] for row in group]):.3f}"
    if group is base:
        return (world, name, *cells, "-", "-", "-", walls, "-", "-", "-")
    return (world, name, *cells, _interval(_times_fewer(base, group, np.median), 1),
            _interval(_times_fewer(base, group, np.mean), 1),
            _share(group, "no_beam_through", "ghost_cells"), walls,
            _share(group, "doors_right", "doors_found"),
            _share(group, "doors_perhaps_right", "doors_perhaps"),
            _share(group, "doors_known_found", "doors_known"))  # fmt: skip


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
