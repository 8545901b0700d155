"""RoutePlanner: how people get from room to room of a floor plan, through its doorways."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence

import numpy as np

from dynslam_env.worlds.clearance import clear_of_legs, legs, sweep
from dynslam_env.worlds.floor_plan import FloorPlan
from slam.errors import InputError
from slam.geometry import Array

PERSON = 0.2  # m, radius
APART = 0.1  # m, that a person keeps from walls, furniture, and wherever a leaf may swing
BEYOND_LEAF = 0.4  # m, from a leaf's reach to where a person waits for it to open
BEYOND_WALL = 0.6  # m, from a wall's face to where a person waits on the other side
BEGIN_APART = 0.6  # m, of people's and the robot's beginnings
TRIES = 30

Point = tuple[float, float]
Stop = tuple[int, int]  # a doorway, and the space on whose side of it one stands
Solid = tuple[int, Array]  # a space, and an outline in it that is not walked into


def waiting_point(plan: FloorPlan, stop: Stop) -> Point:
    """Where one stands before a doorway, m: on its axis, out of reach of its leaf."""
    doorway, space = plan.doorways[stop[0]], stop[1]
    wall, side = plan.wall(doorway), plan.spaces[space]
    along = doorway.start + doorway.width / 2
    depth = side.top - side.bottom if wall.level else side.right - side.left
    away = (wall.high - wall.low) / 2 + min(BEYOND_WALL, depth / 2)
    if doorway.opens_to == space:
        away = doorway.width + BEYOND_LEAF
    across = (wall.low + wall.high) / 2 + (-away if space == wall.lower else away)
    return (along, across) if wall.level else (across, along)


def check_rooms(people: int, depth: float, door_width: float) -> None:
    """People can stand in rooms of this depth, m, behind a leaf that opens into them."""
    need = door_width + BEYOND_LEAF + PERSON + APART
    if people and depth < need:
        raise InputError(
            f"people wait out of reach of a door of {door_width:g} m: rooms must be at least "
            f"{need:g} m deep, got {depth:g} m"
        )


class RoutePlanner:
    """The ways of people: straight from doorway to doorway, clear of `solids` and of all leaves."""

    def __init__(self, plan: FloorPlan, solids: Sequence[Solid] = ()):
        self._plan = plan
        self._solids: list[list[tuple[int, Array]]] = [[] for _ in plan.spaces]
        for space, outline in solids:
            self._solids[space].append((-1, outline))
        self._stops: list[list[int]] = [[] for _ in plan.spaces]
        self._at: dict[Stop, Point] = {}
        for i, doorway in enumerate(plan.doorways):
            if doorway.opens_to is not None:
                self._solids[doorway.opens_to].append((i, sweep(plan.leaf(doorway))))
            for space in doorway.spaces:
                self._at[i, space] = waiting_point(plan, (i, space))
                if self._fits(space, self._at[i, space]):
                    self._stops[space].append(i)
        self._known: dict[Stop, list[tuple[Stop, float]]] = {}

    def route(self, origin: int, goal: int) -> list[Point]:
        """The shortest way from a space to another, from the first doorway to the last, m.

        Dijkstra (1959) over the places before doorways. Empty if there is no way.
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
                for onward, step in self._onward(stop):
                    if onward not in done:
                        heapq.heappush(queue, (length + step, onward, (*way, onward)))
        return []

    def _onward(self, stop: Stop) -> list[tuple[Stop, float]]:
        """Where one can go straight from a stop, and how far, m."""
        if stop not in self._known:
            here = self._at[stop]
            nexts = [other for other in self._neighbours(stop) if self._walkable(stop, other)]
            self._known[stop] = [(other, math.dist(here, self._at[other])) for other in nexts]
        return self._known[stop]

    def _neighbours(self, stop: Stop) -> Iterator[Stop]:
        """Across the doorway, and the other doorways of the same space."""
        doorway, space = stop
        a, b = self._plan.doorways[doorway].spaces
        beyond = a + b - space
        if doorway in self._stops[beyond]:
            yield doorway, beyond
        for other in self._stops[space]:
            if other != doorway:
                yield other, space

    def _walkable(self, stop: Stop, onward: Stop) -> bool:
        leg = [self._at[stop], self._at[onward]]
        crossed = stop[0] if stop[0] == onward[0] else None  # its leaf is waited for
        return all(self.free(space, leg, crossed) for space in {stop[1], onward[1]})

    def free(self, space: int, points: Sequence[Point], crossed: int | None = None) -> bool:
        """The way along `points` keeps clear of all that stands or swings in a space."""
        if not self._solids[space]:
            return True
        way = legs(np.array(points))
        return all(
            clear_of_legs(outline, way, PERSON + APART)
            for doorway, outline in self._solids[space]
            if doorway != crossed
        )

    def _fits(self, space: int, point: Point) -> bool:
        """The point is in the space, a person's width from its walls."""
        left, bottom, right, top = self._plan.spaces[space]
        x, y = point
        far = PERSON + APART
        return left + far <= x <= right - far and bottom + far <= y <= top - far

    def somewhere(self, space: int, before: Point, rng: np.random.Generator) -> list[Point]:
        """A place to stand at in a space, straight on from `before`; none if none was found."""
        left, bottom, right, top = self._plan.spaces[space]
        far = PERSON + APART
        low, high = (left + far, bottom + far), (right - far, top - far)
        for x, y in rng.uniform(low, high, (TRIES, 2)).tolist():
            if math.dist((x, y), before) > far and self.free(space, [(x, y), before]):
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
    """A route (k, 2), m, for each of the `people`, between two different ones of the `rooms`.

    They begin apart from each other and from the robot's `start`.
    """
    routes: list[Array] = []
    if people:
        planner = RoutePlanner(plan, solids)
        for _ in range(people):
            begun = [start, *(tuple(route[0].tolist()) for route in routes)]
            routes.append(_draw_route(planner, rooms, rng, begun))
    return tuple(routes)


def _draw_route(
    planner: RoutePlanner, rooms: Sequence[int], rng: np.random.Generator, begun: Sequence[Point]
) -> Array:
    for _ in range(TRIES):
        origin, goal = rng.choice(rooms, 2, replace=False).tolist()
        way = planner.route(origin, goal)
        if way:
            way = [*planner.somewhere(origin, way[0], rng), *way]
            way += planner.somewhere(goal, way[-1], rng)
            if all(math.dist(way[0], other) >= BEGIN_APART for other in begun):
                return np.array(way)
    raise InputError(
        f"people need ways from room to room on which they keep {PERSON + APART:g} m from walls "
        f"and from wherever a leaf may swing, and places to begin {BEGIN_APART:g} m apart: there "
        f"are none for person number {len(begun)}; make rooms wider, or take fewer people"
    )
