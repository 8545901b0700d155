"""A graph of routes through the free space of a map, and through its doors.

The skeleton of the space in which the robot fits (Zhang and Suen 1984), simplified: points where
ways meet, bend or end, and straight edges along which the robot can drive. A door that was found is
passed by an edge of its own, which carries the door.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.grid import OccupancyGrid
from slam.layers.doors import MappedDoor
from slam.layers.free_space import FreeSpace, Point, free_space
from slam.layers.plane_graph import PlaneGraph
from slam.layers.thinning import skeleton
from slam.validation import positive_number

LONGEST = 10.0  # m of an edge: routers look for the nearest point, not for the nearest edge
MERGED = 1.0  # m: points closer than this become one
SHORTEST_END = 1.0  # m of a dead end, ...
ROOM_SHARE = 1.5  # ... and by the room at the point where it begins: a shorter one is a corner
DETOUR = 1.5  # times an edge: it goes if the way round is shorter
ROUNDS = 4  # of simplification; later ones change hardly anything
BEFORE_DOOR = (0.4, 0.6, 0.8, 1.0)  # m from a door's line to the points before it, tried in turn
STEPS = ((0, 1), (1, -1), (1, 0), (1, 1))  # to neighbours of a cell, each pair once
NO_DOOR = -1


class RouteGraph(NamedTuple):
    """Points and the undirected straight edges between them.

    points  (n, 2) m, map frame
    edges   (m, 2) numbers of their points
    doors   (m,) number of the door that an edge passes, NO_DOOR if none
    """

    points: Array
    edges: np.ndarray
    doors: np.ndarray

    @property
    def lengths(self) -> Array:
        """(m,) m."""
        ends = self.points[self.edges]
        return np.hypot(*(ends[:, 1] - ends[:, 0]).T)


def route_graph(
    grid: OccupancyGrid, doors: Sequence[MappedDoor], radius: float, poses: Array
) -> RouteGraph:
    """The routes of a robot of `radius` (m) in a map of what stands, in the parts that are
    connected with the `poses` (n, 3) where it drove.

    Unknown cells are not free; in `grid`, open and closed leaves of doors are. Raises InputError if
    the robot fits nowhere near any pose.
    """
    positive_number("radius", radius)
    space = free_space(grid, radius, poses)
    graph = _of_skeleton(space)
    for _ in range(ROUNDS):
        graph.straighten(space.sees, LONGEST)
        graph.prune(lambda point: max(SHORTEST_END, ROOM_SHARE * space.room(point)))
        graph.merge(space.sees, MERGED)
        graph.thin_out(DETOUR)
    passed = {}
    for number, door in enumerate(doors):
        _lead_through(door, number, graph, space, passed)
    return _packed(graph, passed)


def _of_skeleton(space: FreeSpace) -> PlaneGraph:
    """The cells of the skeleton, joined with their neighbours."""
    thin = skeleton(space.drivable)
    cells = np.argwhere(thin)
    number = np.full(np.add(thin.shape, 2), -1)
    number[1:-1, 1:-1][thin] = np.arange(len(cells))
    edges = []
    for row, col in STEPS:
        other = number[cells[:, 0] + 1 + row, cells[:, 1] + 1 + col]
        edges.append(np.column_stack([np.arange(len(cells)), other])[other >= 0])
    return PlaneGraph(space.spec.centres(cells), np.concatenate(edges))


def _lead_through(
    door: MappedDoor,
    number: int,
    graph: PlaneGraph,
    space: FreeSpace,
    passed: dict[tuple[int, int], int],
) -> None:
    """Lead each edge that crosses the door straight through its middle; `passed` takes the number
    of the door by the edge."""
    crossing = [edge for edge in graph.edges() if _crosses(door, *(graph.points[k] for k in edge))]
    points = _before_and_behind(door, space)
    if points is None or not crossing:
        passed.update(dict.fromkeys(crossing, number))
        return
    front, back = graph.add(points[0]), graph.add(points[1])
    graph.join(front, back)
    passed[front, back] = number
    for a, b in crossing:
        one, two = (front, back) if _side(door, graph.points[a]) > 0 else (back, front)
        near = space.sees(graph.points[a], graph.points[one])
        if near and space.sees(graph.points[two], graph.points[b]):
            graph.cut(a, b)
            graph.join(a, one)
            graph.join(two, b)
        else:
            passed[a, b] = number
    if len(graph.neighbours[front]) < 2 or len(graph.neighbours[back]) < 2:
        graph.remove(front)
        graph.remove(back)
        del passed[front, back]


def _before_and_behind(door: MappedDoor, space: FreeSpace) -> tuple[Point, Point] | None:
    """Points in front of a door, on its left, and behind it, between which the robot can drive."""
    middle, across = door.ends.mean(axis=0), _across(door)
    for away in BEFORE_DOOR:
        front, back = (_point(middle + side * away * across) for side in (1, -1))
        if space.sees(front, back):
            return front, back
    return None


def _across(door: MappedDoor) -> Array:
    """(2,) unit vector to the left of the way from its first end to its second."""
    line = (door.ends[1] - door.ends[0]) / door.width
    return np.array([-line[1], line[0]])


def _point(place: Array) -> Point:
    x, y = place.tolist()
    return x, y


def _side(door: MappedDoor, point: Point) -> float:
    """m from a door's line, positive to its left."""
    return float((np.array(point) - door.ends[0]) @ _across(door))


def _crosses(door: MappedDoor, a: Point, b: Point) -> bool:
    """Whether the straight edge from `a` to `b` passes the gap of a door."""
    one, two = _side(door, a), _side(door, b)
    if one * two > 0 or one == two:
        return False
    at = np.array(a) + np.subtract(b, a) * one / (one - two)
    along = float((at - door.ends[0]) @ (door.ends[1] - door.ends[0])) / door.width
    return 0.0 <= along <= door.width


def _packed(graph: PlaneGraph, passed: dict[tuple[int, int], int]) -> RouteGraph:
    numbers = {k: n for n, k in enumerate(graph.points)}
    edges = graph.edges()
    doors = [passed.get(edge, NO_DOOR) for edge in edges]
    pairs = [(numbers[a], numbers[b]) for a, b in edges]
    points = np.array(list(graph.points.values())).reshape(-1, 2)
    return RouteGraph(points, np.array(pairs, int).reshape(-1, 2), np.array(doors, int))
