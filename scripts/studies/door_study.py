"""The work of `dynslam doors`: doors found in maps of drives, against the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agents import record_path
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.office import Office
from dynslam_env.worlds.varied import Varied
from slam.benchmark.results import Result
from slam.benchmark.run import build, run
from slam.benchmark.statistics import share
from slam.errors import InputError
from slam.geometry import transform_points
from slam.layers import layers
from slam.layers.doors import PERHAPS, SURE
from slam.metrics.trajectory import FAILURE_ATE, alignment, ate
from slam.validation import unknown_name, whole_number

from ..console.output import own_directory, write_png
from ..figures.style import ESTIMATE, FAINT, SMALL, blank_figure, plain_axes
from ..trials.pool import check_workers
from .drives import run_drives, write_table
from .true_doors import BOTH, CLOSED, OPEN, middles, sightings

if TYPE_CHECKING:
    from .doors import DoorsCommand

VARIANT = "dynamic-graph"
LONG = {"max_episode_steps": 40_000}
WORLDS: dict[str, tuple[str, dict[str, Any]]] = {
    "corridor": ("DoorCorridor-v0", {}),
    "loop": ("DoorLoop-v0", {}),
    "crowd": ("DoorCrowd-v0", {}),
    "office": ("DoorOffice-v0", {}),
    "rounds-1": ("DoorLoop-v0", {"world": Loop(laps=1, people=4), **LONG}),
    "rounds-3": ("DoorLoop-v0", {"world": Loop(laps=3, people=4), **LONG}),
    "corridor-hard": ("DoorCorridor-v0", {"world": Varied(Corridor(), "hard"), **LONG}),
    "loop-hard": ("DoorLoop-v0", {"world": Varied(Loop(), "hard"), **LONG}),
    "office-hard": ("DoorOffice-v0", {"world": Varied(Office(), "hard"), **LONG}),
}
LAWS = "moving", "static"
MAX_ERROR = 0.35  # m between the middles of a found and the true door
BINS = PERHAPS, 0.6, 0.7, 0.8, SURE, 0.95, 0.99, 1.0  # of probability
HEADINGS = "doors", "found as doors", "found, perhaps included", "not found"
STATES = {BOTH: "seen open and closed", CLOSED: "only seen closed", OPEN: "only seen open"}


def study_doors(options: DoorsCommand) -> int:
    """Run, write, print; the exit status."""
    whole_number("seeds", options.seeds, 1)
    whole_number("first", options.first, 0)
    check_workers(options.jobs)
    for kind, names, known in (("world", options.worlds, WORLDS), ("law", options.laws, LAWS)):
        for name in names:
            if name not in known:
                raise InputError(unknown_name(kind, name, known))
    out = own_directory(options.out or Path("out") / "doors")
    seeds = range(options.first, options.first + options.seeds)
    tasks = [
        (world, law, seed)
        for seed in seeds
        for world in options.worlds or WORLDS
        for law in options.laws or LAWS
    ]
    rows, status = run_drives(drive, tasks, options.jobs, out, "doors")
    if rows:
        write_table(table(rows), out)
        reliability(rows, out / "reliability.png")
    return status


def drive(world: str, law: str, seed: int) -> list[Result]:
    """The row of one drive.

    failed whether the robot was lost: the map is then not of this place
    found  of each door that is listed: its probability, whether it is right, whether it moved
    doors  of each true door: what was seen of it, and the probability of what was found there
    """
    env_id, parameters = WORLDS[world]
    episode = record_path(env_id, seed, law, **parameters)
    truth = episode.known_truth("a comparison of doors")
    true = middles(env_id, seed, law, parameters)
    done = run(build(VARIANT, episode, seed), episode)
    made = layers(episode.scans, done.poses, believed=done.grid)
    frame = alignment(done.poses, truth.poses)
    failed = ate(done.poses, truth.poses) > FAILURE_ATE
    places = [transform_points(frame, door.ends).mean(axis=0) for door in made.doors]
    near = np.hypot(*(np.array(places).reshape(-1, 1, 2) - true).transpose(2, 0, 1)) < MAX_ERROR
    right, p = near.any(axis=1), np.array([door.probability for door in made.doors])
    found = [
        [door.probability, bool(ok), door.moved] for door, ok in zip(made.doors, right, strict=True)
    ]
    at = (near * p[:, None]).max(axis=0, initial=0.0).tolist()
    doors = [list(pair) for pair in zip(sightings(episode, true), at, strict=True)]
    row: Result = {"world": world, "law": law, "seed": seed, "failed": failed}
    return [{**row, "found": found, "doors": doors}]


def table(rows: Sequence[Result]) -> str:
    """Markdown: how many of the true doors were found, and how many of the found are right; of all
    drives, and without those that failed, if any did."""
    text = _table(rows)
    good = [row for row in rows if not row["failed"]]
    if len(good) < len(rows):
        few = f"{len(rows) - len(good)} of {len(rows)}"
        text += (
            f"\nWithout the drives whose ATE is above {FAILURE_ATE} m ({few}):\n\n{_table(good)}"
        )
    return text


def _table(rows: Sequence[Result]) -> str:
    doors = [door for row in rows for door in row["doors"]]
    lines = [HEADINGS, ("---",) * len(HEADINGS)]
    groups = {name: [p for state, p in doors if state == key] for key, name in STATES.items()}
    for name, found in groups.items():
        if found:
            counts = [[p >= least for p in found] for least in (SURE, PERHAPS)]
            lines.append((name, *map(_share, counts), str(len(found) - sum(counts[1]))))
    text = "".join(f"| {' | '.join(line)} |\n" for line in lines)
    for moved, name in ((True, "that moved in sight"), (False, "by shape alone")):
        found = [(p, right) for row in rows for p, right, flag in row["found"] if flag == moved]
        sure = [right for p, right in found if p >= SURE]
        perhaps = [right for p, right in found if p < SURE]
        text += f"\nDoors {name}: right {_share(sure)}; perhaps doors: right {_share(perhaps)}.\n"
    return text


def _share(right: Sequence[bool]) -> str:
    if not right:
        return "-"
    found = share(list(right))
    part = f"{100 * found.low:.0f} to {100 * found.high:.0f} %"
    return f"{sum(right)} of {len(right)} ({part})"


def reliability(rows: Sequence[Result], path: Path) -> None:
    """Draw the share of right ones among the listed doors against their probability, of drives that
    did not fail."""
    listed = [one[:2] for row in rows if not row["failed"] for one in row["found"]]
    found = np.array(listed, dtype=float).reshape(-1, 2)
    figure = blank_figure(4.0, 3.8)
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=FAINT, linewidth=0.8)
    for low, high in pairwise(BINS):
        right = found[(found[:, 0] >= low) & ((found[:, 0] < high) | (high == 1.0))]
        if len(right):
            part, p = share((right[:, 1] > 0).tolist()), float(right[:, 0].mean())
            value = float(right[:, 1].mean())
            axes.plot([p, p], [part.low, part.high], color=ESTIMATE, linewidth=1.0)
            axes.plot([p], [value], "o", color=ESTIMATE, markersize=4)
            axes.annotate(str(len(right)), (p, value), xytext=(-4, -10), fontsize=SMALL - 2,
                          textcoords="offset points", ha="right")  # fmt: skip
    axes.set(xlim=(PERHAPS - 0.02, 1.01), ylim=(0.0, 1.02))
    axes.set_xlabel("probability of the doors found (number below)", fontsize=SMALL)
    axes.set_ylabel("share that are doors, 95 % interval", fontsize=SMALL)
    plain_axes(axes)
    write_png(figure, path)
