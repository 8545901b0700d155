"""Goal: a place to go to and a way to look there, for a frontier or for a door."""

from __future__ import annotations

import math
from typing import NamedTuple

from dynslam_env.navigation.frontiers import Frontier
from dynslam_env.navigation.sight import viewpoint
from dynslam_env.navigation.survey import PlanningSnapshot
from slam.geometry import Array

HIDES = 0.5  # m around a door's centre, in which its own leaf does not count as hiding it
NOTHING = (math.inf, math.inf)  # m: the target of a goal that is for nothing in particular


class Goal(NamedTuple):
    """Where to go.

    cell     row, column of the costmap, one that can be reached
    heading  rad, to look there at the end; None: as it comes
    target   x, y in m, what the goal is for: by it a choice knows it again
    """

    cell: tuple[int, int]
    heading: float | None
    target: tuple[float, float]


def explore(survey: PlanningSnapshot, frontier: Frontier) -> Goal | None:
    """Stand before a frontier and look beyond it; None where no way leads there."""
    if frontier.cell is None:
        return None
    heading = _bearing(survey, frontier.cell, frontier.beyond)
    return Goal(frontier.cell, heading, _target(frontier.centroid))


def look_at(survey: PlanningSnapshot, centre: Array) -> Goal | None:
    """Stand where a door's `centre` (2,), m, is seen at the least cost, and look at it; None where
    no such place can be reached."""
    cell = viewpoint(survey.costmap, survey.plan, centre, HIDES)
    if cell is None:
        return None
    return Goal(cell, _bearing(survey, cell, centre), _target(centre))


def _bearing(survey: PlanningSnapshot, cell: tuple[int, int], place: Array) -> float:
    x, y = (place - survey.centre(cell)).tolist()
    return math.atan2(y, x)


def _target(place: Array) -> tuple[float, float]:
    x, y = place.tolist()
    return x, y
