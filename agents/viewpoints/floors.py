"""Floors: viewpoint tables of many drawn floors as arrays, for the fast setting of training."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.viewpoints.table import MAX_VIEWPOINTS, Bools, ViewpointTable, viewpoint_table
from dynslam_env.navigation.planner import plan
from dynslam_env.patrol.questions import floor_costmap, middle
from dynslam_env.simulation.robot import Robot
from dynslam_env.splits import SplitEpisode
from dynslam_env.worlds.layout import Generator, Layout
from slam.geometry import Array

MAX_DOORS = 24  # of a floor, doorways without a leaf included


class Floors(NamedTuple):
    """n floors, each padded to V = MAX_VIEWPOINTS viewpoints and D = MAX_DOORS doorways.

    between  (n, V, V) s; inf where no way leads and for missing viewpoints
    then     (n, V, V, D) whether a doorway is seen on a way or at its end
    doors    (n,) number of doorways
    """

    between: Array
    then: Bools
    doors: NDArray[np.int64]


def draw_floors(world: Generator, split: str, first: int, count: int) -> Floors:
    """Floors `first` to `first + count` of a split, those without a viewpoint left out."""
    radius, tables = Robot().radius, []
    for index in range(first, first + count):
        layout = world.layout(SplitEpisode(split, index).rng().spawn(1)[0])
        table = true_table(layout, radius)
        if len(table.points):
            tables.append(table)
    return _stacked(tables)


def true_table(layout: Layout, radius: float) -> ViewpointTable:
    """The table of a floor by its true plan, driven with all doors closed."""
    costs = floor_costmap(layout, radius)
    return viewpoint_table(costs, plan(costs, layout.start), doorways(layout)[:MAX_DOORS])


def doorways(layout: Layout) -> Array:
    """(d, 4) the true doorways, as in `ViewpointTable.doors`."""
    rows = [[*middle(door), door.closed, door.width] for door in layout.doors]
    return np.array(rows).reshape(-1, 4)


def _stacked(tables: list[ViewpointTable]) -> Floors:
    n, v = len(tables), MAX_VIEWPOINTS
    between = np.full((n, v, v), np.inf)
    then = np.zeros((n, v, v, MAX_DOORS), np.bool_)
    for k, table in enumerate(tables):
        places, doors = len(table.points), len(table.doors)
        between[k, :places, :places] = table.between
        then[k, :places, :places, :doors] = table.then
    return Floors(between, then, np.array([len(table.doors) for table in tables]))
