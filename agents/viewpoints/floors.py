"""Floors: viewpoint tables of many drawn floors as arrays, for the fast setting of training.

Beside the doors, a floor has the doorways without a leaf that a robot suspects: they are found by
scans along the floor's path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.viewpoints.sights import sights
from agents.viewpoints.situation import reach
from agents.viewpoints.table import (
    MAX_VIEWPOINTS,
    Bools,
    ViewpointTable,
    plans_from,
    table_of,
    viewpoints,
    visible,
)
from dynslam_env.navigation.costmap import Costmap
from dynslam_env.navigation.planner import plan
from dynslam_env.patrol.place_doors import PlaceDoors
from dynslam_env.patrol.questions import floor_costmap
from dynslam_env.sensors.laser import Laser, Scanner
from dynslam_env.simulation.robot import Robot
from dynslam_env.splits import SplitEpisode
from dynslam_env.worlds.clearance import leaf
from dynslam_env.worlds.layout import Door, Generator, Layout
from slam.geometry import Array, Pose2

MAX_DOORS = 24  # of a floor, doorways without a leaf included
SAME_DOOR = 0.5  # m, from a suspected doorway to the true one
CLOSED = 0.5  # share of the doors that are closed on the ways of a floor
HEADINGS = np.arange(4) * math.pi / 2  # rad, of the robot at each place of the path
SCAN_STEP = 1.0  # m between two of the places
SWUNG = math.radians(80)  # of the leaves that stand open


class Floors(NamedTuple):
    """n floors, each padded to V = MAX_VIEWPOINTS viewpoints and D = MAX_DOORS doorways.

    between  (n, V, V) s; inf where no way leads and for missing viewpoints
    then     (n, V, V, D) whether the table promises a doorway on a way or at its end
    sights   (n, V, V, D) bit k: it is seen in the k-th of SLICES equal parts of that time
    reveals  (n, V, V) whether one viewpoint is in sight of another, with all doors closed
    reach    (n, V, D) s from a viewpoint until a doorway is seen
    start    (n,) the viewpoint nearest to where the robot starts
    doors    (n,) number of doorways
    leaves   (n,) how many of them, the first ones, have a leaf
    """

    between: Array
    then: Bools
    sights: NDArray[np.uint8]
    reveals: Bools
    reach: Array
    start: NDArray[np.int64]
    doors: NDArray[np.int64]
    leaves: NDArray[np.int64]


def draw_floors(
    world: Generator, split: str, first: int, count: int, drawn: Callable[[], None] = lambda: None
) -> Floors:
    """Floors `first` to `first + count` of a split, those without a viewpoint left out; `drawn` is
    called after each. Ways and sights are those with some of the doors closed, drawn once."""
    rows = []
    for index in range(first, first + count):
        rng = SplitEpisode(split, index).rng()
        layout = world.layout(rng.spawn(1)[0])
        closed = [door for door in layout.doors if rng.random() < CLOSED]
        row = _floor(layout, Robot().radius, closed)
        rows += [row] if len(row.table.points) and row.leaves else []
        drawn()
    return _stacked(rows)


def true_table(layout: Layout, radius: float) -> ViewpointTable:
    """The table of a floor by its true plan, driven with all doors closed."""
    return _floor(layout, radius, layout.doors).table


def doorways(layout: Layout) -> Array:
    """(d, 4) the true doorways, as in `ViewpointTable.doors`."""
    rows = [[*door.middle, door.closed, door.width] for door in layout.doors]
    return np.array(rows).reshape(-1, 4)


def bare_doorways(layout: Layout) -> Array:
    """(b, 4) doorways without a leaf that a robot suspects by its scans on the layout's path."""
    scanner, place = Scanner(Laser(), np.random.default_rng(0)), PlaceDoors()
    for angle in (0.0, SWUNG):
        segments = np.concatenate([layout.walls, *(leaf(door, angle) for door in layout.doors)])
        for x, y in _along(layout.path).tolist():
            for heading in HEADINGS.tolist():
                pose = Pose2(x, y, heading)
                place.look(scanner.scan(scanner.exact(pose, segments), 0.0), pose)
    found = np.array([door.place for door in place.known()]).reshape(-1, 4)
    doors = doorways(layout)
    away = np.hypot(*(found[:, None, :2] - doors[None, :, :2]).transpose(2, 0, 1))
    return found[away.min(axis=1, initial=math.inf) > SAME_DOOR]


def _along(path: Array) -> Array:
    """(n, 2) points on a path (p, 2), SCAN_STEP m apart, m."""
    gone = np.concatenate([[0.0], np.hypot(*np.diff(path, axis=0).T).cumsum()])
    at = np.arange(0.0, gone[-1] + 1e-9, SCAN_STEP)
    return np.stack([np.interp(at, gone, axis) for axis in path.T], axis=1)


class Floor(NamedTuple):
    """One of `Floors`, not yet padded."""

    table: ViewpointTable
    sights: NDArray[np.uint8]
    reveals: Bools
    start: int
    leaves: int


def _floor(layout: Layout, radius: float, closed: Sequence[Door]) -> Floor:
    costs = floor_costmap(layout, radius, closed)
    doors = np.concatenate([doorways(layout), bare_doorways(layout)])[:MAX_DOORS]
    reached = plan(costs, layout.start)
    points = viewpoints(costs, reached, doors)
    plans = plans_from(costs, points)
    table = table_of(costs, points, doors, plans)
    cells = tuple(costs.spec.cells(points).T)
    start = int(reached.length[cells].argmin()) if len(points) else 0
    return Floor(
        table, sights(costs, table, plans), _in_sight(costs, points), start,
        min(len(layout.doors), MAX_DOORS),
    )  # fmt: skip


def _in_sight(costs: Costmap, points: Array) -> Bools:
    """(v, v) whether one of some points (v, 2), m, is seen from another."""
    facing = [np.column_stack([points, np.full(len(points), turn), np.ones(len(points))])
              for turn in (0.0, math.pi / 2)]  # fmt: skip
    return visible(costs, points, facing[0]) | visible(costs, points, facing[1])


def _stacked(rows: list[Floor]) -> Floors:
    n, v = len(rows), MAX_VIEWPOINTS
    between = np.full((n, v, v), np.inf)
    then = np.zeros((n, v, v, MAX_DOORS), np.bool_)
    seen, reveals = np.zeros((n, v, v, MAX_DOORS), np.uint8), np.zeros((n, v, v), np.bool_)
    for k, (table, shown, revealed, *_) in enumerate(rows):
        places, doors = len(table.points), len(table.doors)
        reveals[k, :places, :places] = revealed
        between[k, :places, :places] = table.between
        then[k, :places, :places, :doors] = table.then
        seen[k, :places, :places, :doors] = shown
    starts, leaves = (np.array([getattr(row, name) for row in rows], dtype=np.int64)
                      for name in ("start", "leaves"))  # fmt: skip
    doors = np.array([len(row.table.doors) for row in rows])
    near = np.array([reach(*pair) for pair in zip(between, then, strict=True)])
    return Floors(between, then, seen, reveals, near, starts, doors, leaves)
