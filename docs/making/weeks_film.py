"""Three weeks of one building: a film of its map, and what was learned of its doors.

`python -m docs.making.weeks_film` makes docs/weeks.gif and docs/weeks-doors.png.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np
from dynslam_cli.figures.door_weeks import (  # pyright: ignore[reportMissingImports]
    door_weeks,
    learned_week,
)
from dynslam_cli.figures.film import write_film  # pyright: ignore[reportMissingImports]
from dynslam_cli.figures.layer_cells import (  # pyright: ignore[reportMissingImports]
    palette,
    ranked,
)
from dynslam_cli.figures.style import rendered  # pyright: ignore[reportMissingImports]
from dynslam_cli.figures.week_figure import draw_hours  # pyright: ignore[reportMissingImports]
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from PIL import Image

from agents import record_path
from dynslam_env import Campaign, Doors, Office
from slam.benchmark.run import run, true_start
from slam.io.door_memory import RememberedDoor
from slam.layers import Layers, layers
from slam.registry import make
from slam.sessions.continuation import continued
from slam.sessions.door_memory import remembered, with_remembered
from slam.sessions.pruning import grown
from slam.sessions.relocalisation import certain, compared
from slam.sessions.session import Session, session_of

DOCS = Path(__file__).parents[1]
VARIANT = "dynamic-graph"
CAMPAIGN = Campaign(Office(), days=21, visits=2, minutes=2.0, seed=5300)
MIDDLES = [door.middle for door in CAMPAIGN.building().doors]  # of the true doors
COLUMNS = 2  # of doors
MARGIN = 0.3  # m, of the map around what was seen
HALO = (withStroke(linewidth=2.5, foreground="white"),)
DPI = 80
FRAMES_PER_SECOND, HOLD = 3.0, 4.0


class Day(NamedTuple):
    """The map after a visit.

    begin  s, unix time, of the visit
    made   layers with the doors that are remembered
    doors  what is remembered of each
    """

    begin: float
    made: Layers
    doors: tuple[RememberedDoor, ...]


def visits() -> Iterator[Day]:
    """Map the visits one after the other; each is placed without a start pose."""
    session: Session | None = None
    for visit in CAMPAIGN.plan():
        law = Doors(law=visit.doors)
        episode = visit.dated(record_path(
            "DoorOffice-v0", visit.seed, law, world=visit.layout, max_episode_steps=visit.steps
        ))  # fmt: skip
        if session is None:
            robot = make(VARIANT, true_start(episode))
        else:
            robot = continued(session, VARIANT, certain(compared(session, episode)).pose)
        done = run(robot, episode)
        session = grown(session, session_of(episode, done.poses))
        made = layers(session.scans, session.poses, believed=done.grid)
        doors = remembered(session, made.doors)
        session = replace(session, doors=doors)
        yield Day(visit.begin, with_remembered(made, doors)[0], doors)
        print(visit.date, len(session.scans), "scans,", len(doors), "doors", flush=True)


def frame(day: Day) -> Image.Image:
    """The map after a visit; beside it, what is known of each door's week."""
    figure = Figure((11.0, 5.0), dpi=DPI, layout="constrained")
    rows = -(-len(MIDDLES) // COLUMNS)
    grid = figure.add_gridspec(rows, COLUMNS + 1, width_ratios=(2.2, *(1.0,) * COLUMNS))
    _draw_map(figure.add_subplot(grid[:, 0]), day)
    for k, middle in enumerate(MIDDLES):
        axes = figure.add_subplot(grid[k % rows, 1 + k // rows])
        week = learned_week(day.doors, middle)
        draw_hours(axes, week, f"door {k + 1}: P(open), learned")
    return rendered(figure)


def _draw_map(axes: Axes, day: Day) -> None:
    spec = day.made.spec
    axes.imshow(palette()[ranked(day.made)], origin="lower", extent=spec.extent)
    for one in day.doors:
        axes.plot(*one.door.ends.T, color="#0050d0", linewidth=2.0)
    for k, middle in enumerate(MIDDLES, 1):
        axes.annotate(str(k), tuple(middle), xytext=(4, 4), textcoords="offset points",
                      color="#0050d0", weight="bold", path_effects=HALO)  # fmt: skip
    seen = spec.centres(np.argwhere(~day.made.unknown))
    (left, low), (right, high) = seen.min(axis=0) - MARGIN, seen.max(axis=0) + MARGIN
    axes.set(xlim=(left, right), ylim=(low, high))
    date = datetime.fromtimestamp(day.begin, UTC)
    axes.set_title(f"{date:%A, week} {date.isocalendar().week - 1}, {date:%H:%M}")
    axes.set(xticks=[], yticks=[])


if __name__ == "__main__":
    DAYS = list(visits())
    FILM = [frame(day).quantize(64).convert("RGB") for day in DAYS]
    write_film(FILM, DOCS / "weeks.gif", FRAMES_PER_SECOND, hold=HOLD)
    TRUTHS = [CAMPAIGN.week(number) for number in range(len(MIDDLES))]
    LEARNED = [learned_week(DAYS[-1].doors, middle) for middle in MIDDLES]
    rendered(door_weeks(TRUTHS, LEARNED)).save(DOCS / "weeks-doors.png", optimize=True)
