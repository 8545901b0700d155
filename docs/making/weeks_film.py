"""Three weeks of one building: a film of its map, and what was learned of its doors.

`python -m docs.making.weeks_film` makes docs/weeks.gif and docs/weeks-doors.png.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np
from dynslam_cli.figures.layer_cells import (  # pyright: ignore[reportMissingImports]
    palette,
    ranked,
)
from dynslam_cli.figures.style import rendered  # pyright: ignore[reportMissingImports]
from dynslam_cli.figures.week_figure import COLOUR_MAP, DAYS  # pyright: ignore[reportMissingImports]
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from PIL import Image

from agents import record_path
from dynslam_env import Campaign, Doors, Office
from slam.benchmark.run import run, true_start
from slam.geometry import Array
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
NEAR = 0.5  # m from the middle of a true door to that of one that was found
COLUMNS = 2  # of doors
MARGIN = 0.3  # m, of the map around what was seen
HALO = (withStroke(linewidth=2.5, foreground="white"),)
DPI = 80
FRAMES_PER_SECOND, HOLD = 3.0, 4.0
HOUR = 3600.0


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


def middles() -> Array:
    """(d, 2) middles of the true closed leaves, m."""
    doors = CAMPAIGN.building().doors
    half = [0.5 * d.width * np.array([np.cos(d.closed), np.sin(d.closed)]) for d in doors]
    return np.array([d.hinge for d in doors]) + np.array(half)


def true_week(number: int) -> Array:
    """(7, 24) share of the time in which a true door was open, by weekday and hour."""
    runs = CAMPAIGN.history(number)
    times = np.arange(CAMPAIGN.begin, CAMPAIGN.end, 60.0) + 30.0
    at = np.searchsorted(runs.begin, times, side="right") - 1
    hours = ((times - CAMPAIGN.begin) // HOUR).astype(int) % 168  # it begins on a Monday
    opened = np.bincount(hours, runs.state[at], 168) / np.bincount(hours, minlength=168)
    return opened.reshape(7, 24)


def remembered_at(day: Day, middle: Array) -> RememberedDoor | None:
    """The door that is remembered at a place."""
    near = [one for one in day.doors if np.hypot(*(one.door.ends.mean(axis=0) - middle)) < NEAR]
    return near[0] if near else None


def frame(day: Day, truths: Sequence[Array]) -> Image.Image:
    """The map after a visit; beside it, what is known of each door's week."""
    figure = Figure((11.0, 5.0), dpi=DPI, layout="constrained")
    rows = -(-len(truths) // COLUMNS)
    grid = figure.add_gridspec(rows, COLUMNS + 1, width_ratios=(2.2, *(1.0,) * COLUMNS))
    _draw_map(figure.add_subplot(grid[:, 0]), day)
    for k, middle in enumerate(truths):
        axes = figure.add_subplot(grid[k % rows, 1 + k // rows])
        _draw_learned(axes, remembered_at(day, middle), f"door {k + 1}: P(open), learned")
    return rendered(figure)


def calendar(day: Day, truths: Sequence[Array]) -> Image.Image:
    """Each door's week as it was learned, beside the truth."""
    figure = Figure((10.0, 1.5 * len(truths)), dpi=DPI, layout="constrained")
    axes = figure.subplots(len(truths), 2, squeeze=False)
    for k, middle in enumerate(truths):
        one, truth = remembered_at(day, middle), true_week(k)
        _draw_week(axes[k, 0], truth, f"door {k + 1}: share of the time open, truth")
        _draw_learned(axes[k, 1], one, _compared(one, truth))
    return rendered(figure)


def _compared(one: RememberedDoor | None, truth: Array) -> str:
    if one is None or one.forecast.look is None:
        return "not remembered"
    week = one.forecast.to_dict()
    seen = np.array(week["watched_hours"]) > 0
    off = np.abs(np.array(week["rate"]) - truth)[seen].mean()
    return f"P(open), learned; off by {off:.2f} in the {seen.sum()} hours that were seen"


def _draw_map(axes: Axes, day: Day) -> None:
    spec = day.made.spec
    axes.imshow(palette()[ranked(day.made)], origin="lower", extent=spec.extent)
    for one in day.doors:
        axes.plot(*one.door.ends.T, color="#0050d0", linewidth=2.0)
    for k, middle in enumerate(middles(), 1):
        axes.annotate(str(k), middle, xytext=(4, 4), textcoords="offset points", color="#0050d0",
                      weight="bold", path_effects=HALO)  # fmt: skip
    seen = spec.centres(np.argwhere(~day.made.unknown))
    (left, low), (right, high) = seen.min(axis=0) - MARGIN, seen.max(axis=0) + MARGIN
    axes.set(xlim=(left, right), ylim=(low, high))
    date = datetime.fromtimestamp(day.begin, UTC)
    axes.set_title(f"{date:%A, week} {date.isocalendar().week - 1}, {date:%H:%M}")
    axes.set(xticks=[], yticks=[])


def _draw_learned(axes: Axes, one: RememberedDoor | None, title: str) -> None:
    rate = np.full((7, 24), np.nan)
    if one is not None and one.forecast.look is not None:
        week = one.forecast.to_dict()
        seen = np.array(week["watched_hours"]) > 0
        rate[seen] = np.array(week["rate"])[seen]
    _draw_week(axes, rate, title)


def _draw_week(axes: Axes, rate: Array, title: str) -> None:
    colours = colormaps[COLOUR_MAP].with_extremes(bad="#d8d8d8")
    axes.imshow(np.ma.masked_invalid(rate), cmap=colours, vmin=0.0, vmax=1.0, aspect="auto",
                extent=(0, 24, 7, 0))  # fmt: skip
    axes.set_xticks(range(0, 25, 6))
    axes.set_yticks(np.arange(7) + 0.5, [day[:2] for day in DAYS])
    axes.tick_params(labelsize=6)
    axes.set_title(title, fontsize=8)
