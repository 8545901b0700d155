"""Things that stand about for hours or days: furniture that is moved, boxes left and taken."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dynslam_env.calendar.door_calendar import DAY
from dynslam_env.worlds.clearance import any_crossing, clear, clear_of_legs, edges, gap, legs, sweep
from dynslam_env.worlds.layout import Layout
from slam.geometry import Array

FREE_WAY = 0.5  # m, that things keep from the robot's path
WAY_OF_PEOPLE = 0.3  # m, that they keep from the routes of people
BESIDE_WALL, BESIDE_THINGS = 0.03, 0.1  # m, that they keep from walls, leaves and other things
REACH = 3.5  # m, from the path to the middle of a thing
MAX_TRIES = 60  # places tried for a thing; if none is free, it is not there


class Kind(NamedTuple):
    """A kind of things.

    sides   m, shortest and longest side
    stays   s, mean time at one place (exponential)
    absent  s, mean time until it is put somewhere else
    """

    sides: tuple[float, float]
    stays: float
    absent: float


FURNITURE = Kind((0.4, 1.1), 4.0 * DAY, 1.0)
BOX = Kind((0.25, 0.6), 0.7 * DAY, 0.7 * DAY)


class Thing(NamedTuple):
    """Something at one place.

    outline       (4, 4) m, edges
    since, until  s, unix time
    """

    outline: Array
    since: float
    until: float


def clutter(
    layout: Layout, counts: dict[Kind, int], begin: float, end: float, rng: np.random.Generator
) -> list[Thing]:
    """The things in a world from `begin` to `end`, s, by the time since when they stand there.

    counts  number of things of each kind, those absent included
    """
    times = [
        (since, until, kind)
        for kind, count in counts.items()
        for _ in range(count)
        for since, until in _stays(kind, begin, end, rng)
    ]
    placed: list[Thing] = []
    for since, until, kind in sorted(times):
        others = [thing.outline for thing in placed if thing.until > since]
        outline = _place(layout, kind, others, rng)
        if outline is not None:
            placed.append(Thing(outline, since, until))
    return placed


def with_things(layout: Layout, things: list[Thing], time: float) -> Array:
    """(w, 4) m, the walls with the edges of all things that stand there at `time`, s."""
    there = [thing.outline for thing in things if thing.since <= time < thing.until]
    return np.concatenate([layout.walls, *there])


def _stays(
    kind: Kind, begin: float, end: float, rng: np.random.Generator
) -> list[tuple[float, float]]:
    """Times, s, from and until which one thing stands somewhere."""
    there = rng.random() * (kind.stays + kind.absent) < kind.stays
    time = begin if there else begin + rng.exponential(kind.absent)
    found = []
    while time < end:
        until = time + rng.exponential(kind.stays)
        found.append((time, until))
        time = until + rng.exponential(kind.absent)
    return found


def _place(
    layout: Layout, kind: Kind, others: list[Array], rng: np.random.Generator
) -> Array | None:
    """The outline of a thing at a free place that can be seen from the path; None without one."""
    way = legs(layout.path)
    swept = [sweep(door) for door in layout.doors]
    routes = [legs(route) for route in layout.routes]
    for _ in range(MAX_TRIES):
        seen_from, middle = _drawn(way, rng)
        outline = _rectangle(middle, kind, rng)
        if any_crossing(np.array([[*seen_from, *middle]]), layout.walls):
            continue
        if gap(outline, layout.walls) < BESIDE_WALL or not clear_of_legs(outline, way, FREE_WAY):
            continue
        if not all(clear_of_legs(outline, route, WAY_OF_PEOPLE) for route in routes):
            continue
        if all(clear(outline, other, BESIDE_THINGS) for other in (*swept, *others)):
            return outline
    return None


def _drawn(way: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """A point of the path, and one near it, m."""
    lengths = np.hypot(*(way[:, 2:] - way[:, :2]).T)
    leg = way[rng.choice(len(way), p=lengths / lengths.sum())]
    point = leg[:2] + rng.random() * (leg[2:] - leg[:2])
    angle, away = rng.uniform(0.0, math.tau), rng.uniform(FREE_WAY, REACH)
    return point, point + away * np.array([math.cos(angle), math.sin(angle)])


def _rectangle(middle: Array, kind: Kind, rng: np.random.Generator) -> Array:
    (long, short), angle = rng.uniform(*kind.sides, 2) / 2.0, rng.uniform(0.0, math.pi)
    corners = np.array([(long, short), (-long, short), (-long, -short), (long, -short)])
    c, s = math.cos(angle), math.sin(angle)
    return edges(corners @ np.array([(c, s), (-s, c)]) + middle)
