"""Routes of people from room to room of a floor plan, through its doorways."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence

import numpy as np

from dynslam_env.worlds.clearance import clear_of_legs, sweep
from dynslam_env.worlds.floor_plan import FloorPlan
from slam.errors import InputError
from slam.geometry import Array

PERSON_RADIUS = 0.2  # m, radius
PERSON_CLEARANCE = 0.1  # m, of a person from walls, furniture, and the areas that leaves sweep
LEAF_WAITING_DISTANCE = 0.4  # m, beyond the reach of a leaf, where a person waits for it to open
WALL_WAITING_DISTANCE = 0.6  # m, from the wall, where a person waits on the other side
MIN_START_DISTANCE = 0.6  # m, between the starts of people and the robot
MAX_ROUTE_TRIES = 30  # routes, and points to end them at, drawn for a person

Point = tuple[float, float]
Stop = tuple[int, int]  # a doorway, and the space on one side of it
Solid = tuple[int, Array]  # a space, and the outline of an obstacle in it


def waiting_point(plan: FloorPlan, stop: Stop) -> Point:
    """The point before a doorway, m, on its axis and out of reach of its leaf."""
    doorway, space = plan.doorways[stop[0]], stop[1]
    wall, side = plan.wall(doorway), plan.spaces[space]
    along = doorway.start + doorway.width / 2
    depth = side.top - side.bottom if wall.level else side.right - side.left
    away = (wall.high - wall.low) / 2 + min(WALL_WAITING_DISTANCE, depth / 2)
    if doorway.opens_to == space:
        away = doorway.width + LEAF_WAITING_DISTANCE
    across = (wall.low + wall.high) / 2 + (-away if space == wall.lower else away)
    return (along, across) if wall.level else (across, along)


def check_rooms(people: int, depth: float, door_width: float) -> None:
    """Check that people fit behind a leaf that opens into a room of this depth, m."""
    need = door_width + LEAF_WAITING_DISTANCE + PERSON_RADIUS + PERSON_CLEARANCE
    if people and depth < need:
        raise InputError(
            f"people wait out of reach of a door of {door_width:g} m: rooms must be at least "
            f"{need:g} m deep, got {depth:g} m"
        )


class RoutePlanner:
    """Plans routes that are straight from doorway to doorway and clear of solids and leaves."""

    def __init__(self, plan: FloorPlan, solids: Sequence[Solid] = ()):
        self._plan = plan
        self._solids: list[list[tuple[int, Array]]] = [[] for _ in plan.spaces]
        for space, outline in solids:
            self._solids[space].append((-1, outline))
        self._stops: list[list[int]] = [[] for _ in plan.spaces]
        self._at: dict[Stop, Point] = {}
        for i, doorway in enumerate(plan.doorways):
            if doorway.opens_to is not None:
                swept = [(i, sweep(leaf)) for leaf in plan.leaves(doorway)]
                self._solids[doorway.opens_to] += swept
            for space in doorway.spaces:
                self._at[i, space] = waiting_point(plan, (i, space))
                if self._fits(space, self._at[i, space]):
                    self._stops[space].append(i)
        self._successors_of: dict[Stop, list[tuple[Stop, float]]] = {}

    def route(self, origin: int, goal: int) -> list[Point]:
        """The shortest route from a space to another, from the first doorway to the last, m.

        Dijkstra (1959) over the points before doorways. Empty if there is no route.
        """
        queue: list[tuple[float, Stop, tuple[Stop, ...]]] = []
        queue += [(0.0, (i, origin), ((i, origin),)) for i in self._stops[origin]]
        done: set[Stop] = set()
        while queue:
            length, stop, way = heapq.heappop(queue)
            if stop[1] == goal:
                return [self._at[each] for each in way]
            if stop not in done:
                done.add(stop)
                for onward, step in self._successors(stop):
                    if onward not in done:
                        heapq.heappush(queue, (length + step, onward, (*way, onward)))
        return []

    def _successors(self, stop: Stop) -> list[tuple[Stop, float]]:
        """The stops that can be reached straight from a stop, and their distances, m."""
        if stop not in self._successors_of:
            here = self._at[stop]
            nexts = [other for other in self._neighbours(stop) if self._walkable(stop, other)]
            self._successors_of[stop] = [
                (other, math.dist(here, self._at[other])) for other in nexts
            ]
        return self._successors_of[stop]

    def _neighbours(self, stop: Stop) -> Iterator[Stop]:
        """The other side of the doorway, and the other doorways of the same space."""
        doorway, space = stop
        a, b = self._plan.doorways[doorway].spaces
        beyond = a + b - space
        if doorway in self._stops[beyond]:
            yield doorway, beyond
        for other in self._stops[space]:
            if other != doorway:
                yield other, space

    def _walkable(self, stop: Stop, onward: Stop) -> bool:
        leg = self._at[stop], self._at[onward]
        crossed = stop[0] if stop[0] == onward[0] else None  # people wait until its leaf is open
        return all(self.free(space, *leg, crossed) for space in {stop[1], onward[1]})

    def free(self, space: int, here: Point, there: Point, crossed: int | None = None) -> bool:
        """Whether the straight way between two points keeps clear of solids and leaves in a space,
        but for the leaf of the doorway that is `crossed`."""
        if not self._solids[space]:
            return True
        way = np.array([(*here, *there)])
        return all(
            clear_of_legs(outline, way, PERSON_RADIUS + PERSON_CLEARANCE)
            for doorway, outline in self._solids[space]
            if doorway != crossed
        )

    def _fits(self, space: int, point: Point) -> bool:
        """Whether a person at the point is in the space and clear of its walls."""
        left, bottom, right, top = self._plan.spaces[space]
        x, y = point
        margin = PERSON_RADIUS + PERSON_CLEARANCE
        return left + margin <= x <= right - margin and bottom + margin <= y <= top - margin

    def draw_point(self, space: int, before: Point, rng: np.random.Generator) -> list[Point]:
        """A random free point straight on from `before`, in a list; empty if none was found."""
        left, bottom, right, top = self._plan.spaces[space]
        margin = PERSON_RADIUS + PERSON_CLEARANCE
        low, high = (left + margin, bottom + margin), (right - margin, top - margin)
        for x, y in rng.uniform(low, high, (MAX_ROUTE_TRIES, 2)).tolist():
            if math.dist((x, y), before) > margin and self.free(space, (x, y), before):
                return [(x, y)]
        return []


def draw_routes(
    plan: FloorPlan,
    rooms: Sequence[int],
    people: int,
    rng: np.random.Generator,
    start: Point,
    solids: Sequence[Solid] = (),
) -> tuple[Array, ...]:
    """A route (k, 2), m, for each of the `people`, between two random `rooms`.

    Their starts keep a distance from each other and from the robot's `start`.
    """
    routes: list[Array] = []
    if people:
        planner = RoutePlanner(plan, solids)
        for _ in range(people):
            starts = [start, *(tuple(route[0].tolist()) for route in routes)]
            routes.append(_draw_route(planner, rooms, rng, starts))
    return tuple(routes)


def _draw_route(
    planner: RoutePlanner, rooms: Sequence[int], rng: np.random.Generator, starts: Sequence[Point]
) -> Array:
    for _ in range(MAX_ROUTE_TRIES):
        origin, goal = rng.choice(rooms, 2, replace=False).tolist()
        way = planner.route(origin, goal)
        if way:
            way = [*planner.draw_point(origin, way[0], rng), *way]
            way += planner.draw_point(goal, way[-1], rng)
            if all(math.dist(way[0], other) >= MIN_START_DISTANCE for other in starts):
                return np.array(way)
    margin = PERSON_RADIUS + PERSON_CLEARANCE
    raise InputError(
        f"people need ways from room to room on which they keep {margin:g} m from walls and from "
        f"wherever a leaf may swing, and places to begin {MIN_START_DISTANCE:g} m apart: there "
        f"are none for person number {len(starts)}; make rooms wider, or take fewer people"
    )
