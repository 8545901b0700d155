"""Checks of start poses: robot and people must not overlap walls, leaves or each other."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from dynslam_env.worlds.clearance import farther, gap, inside, leaf, legs
from dynslam_env.worlds.layout import Layout
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.validation import positive_number


def check_start(layout: Layout, start: Pose2, radius: float, open_angle: float) -> None:
    """Check that a robot of `radius` m at `start` overlaps no wall, and no leaf closed or open.

    Raises InputError that names the pose and what it overlaps.
    """
    positive_number("the robot's radius", radius)
    for what, outline in _near(layout, start, radius, open_angle):
        within = len(outline) > 1 and inside(outline, start.x, start.y)
        depth = radius + (1 if within else -1) * _distance(start, outline)
        if depth > 0:
            raise InputError(
                f"the robot cannot begin at x = {start.x:g}, y = {start.y:g} m: with its radius of "
                f"{radius:g} m it would be {depth:.3g} m inside {what}; allowed is any place where "
                "it touches no wall and no leaf, closed or open"
            )


def check_people(layout: Layout, places: Array, radius: float, robot: float) -> None:
    """Check that people of `radius` m fit at their starts `places` (p, 2) and on their routes.

    robot  m, radius of the robot, which is at the layout's start
    Raises InputError that names the person and the obstacle.
    """
    for i, (route, place) in enumerate(zip(layout.routes, places, strict=True)):
        away = math.dist(place, layout.start[:2])
        if away < radius + robot:
            raise InputError(
                f"the robot cannot begin at x = {layout.start.x:g}, y = {layout.start.y:g} m: "
                f"person {i} begins {away:.3g} m from there"
            )
        way = np.vstack([legs(route), legs(np.vstack([place, route[0]]))])
        if not farther(way, layout.walls, radius):
            space = gap(way, layout.walls)
            raise InputError(
                f"person {i} of radius {radius:g} m does not fit: its route passes {space:.3g} m "
                "from a wall"
            )


def check_inside(layout: Layout, start: Pose2) -> None:
    """Check that `start` is within the extent of the walls if the layout's own start is.

    Raises InputError that names the extent.
    """
    ends = layout.walls.reshape(-1, 2)
    if len(ends) and _within(layout.start, ends) and not _within(start, ends):
        raise InputError(
            f"the robot cannot begin at x = {start.x:g}, y = {start.y:g} m, outside of the world, "
            f"which lies within {ends.min(axis=0).tolist()} and {ends.max(axis=0).tolist()} m"
        )


def _within(start: Pose2, ends: Array) -> bool:
    place = np.array(start[:2])
    return bool((place > ends.min(axis=0)).all() and (place < ends.max(axis=0)).all())


def _near(
    layout: Layout, start: Pose2, radius: float, open_angle: float
) -> Iterator[tuple[str, Array]]:
    """Names and outlines of the walls and leaves near the robot."""
    if len(layout.walls) and _distance(start, layout.walls) < radius:
        for i, wall in enumerate(layout.walls):
            x1, y1, x2, y2 = wall
            yield f"wall {i} from ({x1:g}, {y1:g}) to ({x2:g}, {y2:g})", wall[None]
    for i, door in enumerate(layout.doors):
        if math.dist(start[:2], door.hinge) < radius + door.width + door.thickness:
            x, y = door.hinge
            for state, angle in (("closed", 0.0), ("open", open_angle)):
                yield f"the {state} leaf of door {i}, hinged at ({x:g}, {y:g})", leaf(door, angle)


def _distance(start: Pose2, segments: Array) -> float:
    return gap(np.array([(start.x, start.y, start.x, start.y)]), segments)
