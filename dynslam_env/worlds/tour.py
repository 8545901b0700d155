"""Tour: a path through all rooms of a tree of doorways, and back."""

from __future__ import annotations

import math
from itertools import pairwise

from dynslam_env.worlds.floor_plan import FloorPlan
from dynslam_env.worlds.routes import Point, Stop, waiting_point

MIN_LEG_LENGTH = 1.0  # m, from doorway to doorway; a shorter one is too short to steer on
MIDDLE = -1  # in place of a doorway: the middle of the space


def tour(plan: FloorPlan, root: int) -> list[Point]:
    """Waypoints, m, from the middle of the space `root` through all spaces and back to there.

    Each doorway is crossed straight, from a point before it to one behind it, once in each
    direction. In a space with one doorway the tour turns in the middle. The doorways form a tree.
    """
    doorways: list[list[int]] = [[] for _ in plan.spaces]  # of each space
    for i, doorway in enumerate(plan.doorways):
        for space in doorway.spaces:
            doorways[space].append(i)
    stops = [(MIDDLE, root), *_visit(plan, doorways, root, None)]
    if stops[-1] != (MIDDLE, root):
        stops.append((MIDDLE, root))
    at = {stop: _at(plan, stop) for stop in set(stops)}
    points = [at[stops[0]]]
    for before, stop in pairwise(stops):
        corner = None
        if MIDDLE not in (before[0], stop[0]) and before[1] == stop[1]:
            corner = _corner(plan, at, before, stop)
        points[-1:] = [corner] if corner else [points[-1], at[stop]]
    return points


def _visit(
    plan: FloorPlan, doorways: list[list[int]], space: int, entrance: int | None
) -> list[Stop]:
    way: list[Stop] = []
    for i in doorways[space]:
        if i != entrance:
            a, b = plan.doorways[i].spaces
            here, there = (i, space), (i, a + b - space)
            way += [here, there, *_visit(plan, doorways, there[1], i), there, here]
    return way or [(MIDDLE, space)]


def _at(plan: FloorPlan, stop: Stop) -> Point:
    doorway, space = stop
    if doorway != MIDDLE:
        return waiting_point(plan, stop)
    left, bottom, right, top = plan.spaces[space]
    return (left + right) / 2, (bottom + top) / 2


def _corner(plan: FloorPlan, at: dict[Stop, Point], before: Stop, stop: Stop) -> Point | None:
    """Intersection of the axes of two close doorways of a space, m, which replaces the points
    before both."""
    here, there = at[before], at[stop]
    if math.dist(here, there) >= MIN_LEG_LENGTH:
        return None
    level = [plan.wall(plan.doorways[each[0]]).level for each in (before, stop)]
    if level[0] == level[1]:
        return None
    return (here[0], there[1]) if level[0] else (there[0], here[1])
