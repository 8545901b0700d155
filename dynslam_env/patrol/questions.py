"""Questions of the way from A to B, and the time that a wrong belief about the doors costs.

A question is asked of a robot that knows the floor plan, but not which doors are open: for that it
has its belief. It takes the way that seems shortest, where each doorway costs its own length and
P(closed) times the detour around it. A door that it finds closed on its way turns it back: it then
takes the best way on from there. The regret is the length of what it drives beyond the best way
through the doors that are open when it is asked, divided by a speed: the travelling salesman of
doors is Papadimitriou and Yannakakis's Canadian traveller (1991). Doors stand still meanwhile.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy.sparse.csgraph import dijkstra

from dynslam_env.navigation.costmap import (
    Costmap,
    Inflation,
    inflated,
    kinds_of,
    nearer_than,
)
from dynslam_env.navigation.planner import plan, reached
from dynslam_env.simulation.laws import Bools
from dynslam_env.worlds.clearance import leaf
from dynslam_env.worlds.layout import Door, Layout
from slam.geometry import Array, Pose2
from slam.grid import GridSpec
from slam.metrics.raster import rasterise

CELL = 0.1  # m
MAX_PLACES = 16  # of which two are drawn for a question
MARGIN = 0.3  # m, between a place and the nearest wall
SIDE_DISTANCE = 0.55  # m, from the middle of a doorway to the points on its two sides
DRIVING_SPEED = 0.5  # m/s
MAX_DETOUR = 60.0  # m, of a door without a way around it
MAX_DRAWS = 10  # of two places with a way between them


def floor_costmap(layout: Layout, radius: float, closed: Sequence[Door]) -> Costmap:
    """The costmap of a floor for a robot of `radius` m, with only these doors, which are closed."""
    spec, walls, leaves = _floor(layout, closed)
    occupied = walls | leaves
    return inflated(spec, occupied, np.ones_like(occupied), np.zeros_like(occupied), radius)


def _floor(layout: Layout, closed: Sequence[Door]) -> tuple[GridSpec, Bools, Bools]:
    """The grid of a floor, (rows, cols) whether a wall is there, and whether one of these doors."""
    leaves = np.concatenate([np.empty((0, 4)), *(leaf(door, 0.0) for door in closed)])
    ends = np.concatenate([layout.walls, leaves]).reshape(-1, 2)
    low, high = ends.min(axis=0), ends.max(axis=0)
    spec = GridSpec.around((low[0], low[1]), (high[0], high[1]), CELL)
    return spec, rasterise(layout.walls, spec), rasterise(leaves, spec)


def _reached(spec: GridSpec, walls: Bools, radius: float, start: Pose2) -> Bools:
    """(rows, cols) the cells to which the robot can drive from its start among these walls."""
    near = nearer_than(walls, CELL, radius + Inflation().margin)
    return reached(spec, kinds_of(walls, np.ones_like(walls), near), start)


class Questions:
    """The ways of one floor, and the regret of a belief about its doors.

    layout  of the episode
    radius  m, of the robot
    rng     draws the places, and the two of each question
    """

    def __init__(self, layout: Layout, radius: float, rng: np.random.Generator):
        self._rng, self._doors = rng, len(layout.doors)
        self._layout, self._radius = layout, radius
        spec, walls, leaves = _floor(layout, layout.doors)
        there = _reached(spec, walls, radius, layout.start)
        least = np.nextafter(radius + MARGIN, np.inf)  # the clearance must be more than this sum
        wide = there & ~nearer_than(walls | leaves, CELL, least)
        cells = np.flatnonzero(wide if wide.any() else there)
        self._places = min(MAX_PLACES, len(cells))
        drawn = cells[rng.choice(len(cells), self._places, replace=False)]
        places = spec.centres(np.column_stack(np.divmod(drawn, spec.cols)))
        self._nodes = np.concatenate([_sides(layout.doors), places])

    @cached_property
    def _far(self) -> Array:
        """(n, n) m, between the nodes; many plans, which a floor needs at the first question."""
        costs = floor_costmap(self._layout, self._radius, self._layout.doors)
        return _distances(costs, self._nodes)

    @cached_property
    def _detours(self) -> Array:
        """(d,) m, between the sides of each closed door."""
        ways = [self._far[2 * d, 2 * d + 1] for d in range(self._doors)]
        return np.minimum(ways, MAX_DETOUR)

    def regret(self, closed: Array, is_open: Bools) -> float | None:
        """s lost at one question, drawn now; None if no way leads there, or nowhere.

        closed   (d,) P(closed) of the doors, by the robot's belief
        is_open  (d,) the truth
        """
        for _ in range(MAX_DRAWS if self._places > 1 else 0):
            start, goal = 2 * self._doors + self._rng.choice(self._places, 2, replace=False)
            best = self._best(start, goal, is_open)
            if np.isfinite(best):
                return (self._driven(start, goal, closed, is_open) - best) / DRIVING_SPEED
        return None

    def _best(self, start: int, goal: int, is_open: Bools) -> float:
        prices = np.where(is_open, 2 * SIDE_DISTANCE, np.inf)
        return float(dijkstra(self._graph(prices), indices=start)[goal])

    def _driven(self, start: int, goal: int, closed: Array, is_open: Bools) -> float:
        """m, driven by a robot that turns back at doors that it finds closed."""
        prices, driven, at = 2 * SIDE_DISTANCE + closed * self._detours, 0.0, start
        while at != goal:
            after = self._next(at, goal, prices)
            door = at // 2
            if after // 2 != door or at >= 2 * self._doors:
                driven += self._far[at, after]
            elif is_open[door]:
                driven, prices[door] = driven + 2 * SIDE_DISTANCE, 2 * SIDE_DISTANCE
            elif np.isinf(prices[door]):
                driven += self._far[at, after]  # around it
            else:
                prices[door] = np.inf
                continue
            at = after
        return driven

    def _next(self, at: int, goal: int, prices: Array) -> int:
        """The node after `at` on the way that seems shortest."""
        before = dijkstra(self._graph(prices), indices=goal, return_predecessors=True)[1]
        return int(before[at])

    def _graph(self, prices: Array) -> Array:
        """(n, n) m, between the nodes; inf where nothing leads."""
        graph = self._far.copy()
        for door, price in enumerate(prices):
            a, b = 2 * door, 2 * door + 1
            graph[a, b] = graph[b, a] = min(graph[a, b], price)
        return graph


def _sides(doors: Sequence[Door]) -> Array:
    """(2 d, 2) m, points on both sides of each doorway."""
    closed = np.array([door.closed for door in doors])
    across = np.column_stack([-np.sin(closed), np.cos(closed)]) * SIDE_DISTANCE
    middles = np.reshape([door.middle for door in doors], (-1, 2))
    return np.stack([middles + across, middles - across], axis=1).reshape(-1, 2)


def _distances(costs: Costmap, nodes: Array) -> Array:
    """(n, n) m, along the cheapest ways between points; inf where none leads."""
    cells = costs.spec.cells(nodes)
    far = np.array([plan(costs, Pose2(x, y, 0.0)).length[tuple(cells.T)] for x, y in nodes])
    return np.minimum(far, far.T)
