"""Goal: a cell to drive to and a heading to take there, for a frontier or for a door."""

from __future__ import annotations

import math
from typing import NamedTuple

from dynslam_env.navigation.frontiers import Frontier, Point
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from dynslam_env.navigation.sight import viewpoint
from slam.geometry import Array

LEAF_RADIUS = 0.5  # m around a door's centre, in which its own leaf does not count as hiding it
NO_TARGET = (math.inf, math.inf)  # m: of a goal without a target


class Goal(NamedTuple):
    """A place to drive to.

    cell     row, column of the costmap, one that can be reached
    heading  rad, to turn to at the end; None: as the robot arrives
    target   x, y in m of the frontier or door; it identifies the goal in later maps
    """

    cell: tuple[int, int]
    heading: float | None
    target: tuple[float, float]


def explore(planning: PlanningSnapshot, frontier: Frontier) -> Goal | None:
    """Stand before a frontier and look beyond it; None if no path leads there."""
    if frontier.cell is None:
        return None
    heading = _bearing(planning, frontier.cell, frontier.beyond)
    return Goal(frontier.cell, heading, frontier.centroid)


def look_at(planning: PlanningSnapshot, centre: Array) -> Goal | None:
    """Look at a door's `centre` (2,), m, from the cell of least path cost that sees it; None where
    no such cell can be reached."""
    cell = viewpoint(planning.costmap, planning.plan, centre, LEAF_RADIUS)
    if cell is None:
        return None
    x, y = centre.tolist()
    return Goal(cell, _bearing(planning, cell, (x, y)), (x, y))


def _bearing(planning: PlanningSnapshot, cell: tuple[int, int], place: Point) -> float:
    (x, y), (here_x, here_y) = place, planning.centre(cell)
    return math.atan2(y - here_y, x - here_x)
