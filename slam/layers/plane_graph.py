"""A graph of points in the plane with straight edges, and its simplification.

Every operation leaves connected what was connected, and makes only edges along which one can drive.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable

import numpy as np

from slam.geometry import Array
from slam.layers.free_space import Point

Sees = Callable[[Point, Point], bool]
"""Whether one can drive straight from one point to another."""


class PlaneGraph:
    """Points and undirected straight edges between them.

    points      m, by number
    neighbours  numbers, by number
    """

    def __init__(self, points: Array, edges: np.ndarray):
        """points (n, 2) m; edges (m, 2), the numbers of their ends."""
        self.points: dict[int, Point] = {k: (x, y) for k, (x, y) in enumerate(points.tolist())}
        self.neighbours: dict[int, set[int]] = {k: set() for k in self.points}
        for a, b in edges.tolist():
            self.join(a, b)

    def join(self, a: int, b: int) -> None:
        """Add an edge."""
        if a != b:
            self.neighbours[a].add(b)
            self.neighbours[b].add(a)

    def cut(self, a: int, b: int) -> None:
        """Remove an edge."""
        self.neighbours[a].discard(b)
        self.neighbours[b].discard(a)

    def add(self, point: Point) -> int:
        """Add a point; its number."""
        number = max(self.points, default=-1) + 1
        self.points[number], self.neighbours[number] = point, set()
        return number

    def remove(self, k: int) -> None:
        """Remove a point with its edges."""
        for other in self.neighbours.pop(k):
            self.neighbours[other].discard(k)
        del self.points[k]

    def length(self, a: int, b: int) -> float:
        """m between two points."""
        return math.dist(self.points[a], self.points[b])

    def edges(self) -> list[tuple[int, int]]:
        """Every edge once, the smaller number first."""
        return sorted((a, b) for a, near in self.neighbours.items() for b in near if a < b)

    # -- simplification --------------------------------------------------------------------------

    def straighten(self, sees: Sees, longest: float) -> None:
        """Remove points with two edges where a straight edge, no longer than `longest` (m), can
        take their place."""
        for k in list(self.points):
            if len(self.neighbours[k]) == 2:
                a, b = self.neighbours[k]
                if self.length(a, b) <= longest and sees(self.points[a], self.points[b]):
                    self.remove(k)
                    self.join(a, b)

    def merge(self, sees: Sees, distance: float) -> None:
        """Merge the ends of edges shorter than `distance` (m) into one of them, that from which all
        neighbours of the other are seen."""
        for a, b in sorted(self.edges(), key=lambda edge: self.length(*edge)):
            if a in self.points and b in self.points and b in self.neighbours[a]:
                if self.length(a, b) >= distance:
                    continue
                for kept, gone in ((a, b), (b, a)):
                    others = self.neighbours[gone] - {kept}
                    if all(sees(self.points[kept], self.points[k]) for k in others):
                        self.remove(gone)
                        for k in others:
                            self.join(kept, k)
                        break

    def prune(self, least: Callable[[Point], float]) -> None:
        """Remove dead ends shorter than `least` (m) at the point where they begin, one after
        another; a last edge stays."""
        ends = sorted(
            (self.length(k, next(iter(near))), k)
            for k, near in self.neighbours.items()
            if len(near) == 1
        )
        for _, k in ends:
            if len(self.neighbours[k]) == 1:
                (at,) = self.neighbours[k]
                if len(self.neighbours[at]) > 1 and self.length(k, at) < least(self.points[at]):
                    self.remove(k)

    def thin_out(self, detour: float) -> None:
        """Remove edges, the longest first, where the way round is shorter than `detour` times the
        edge."""
        for a, b in sorted(self.edges(), key=lambda edge: -self.length(*edge)):
            most = detour * self.length(a, b)
            self.cut(a, b)
            if self.way(a, b, most) > most:
                self.join(a, b)

    def way(self, a: int, b: int, most: float = math.inf) -> float:
        """m of the shortest way between two points; infinity if it is longer than `most`."""
        best, queue = {a: 0.0}, [(0.0, a)]
        while queue:
            gone, k = heapq.heappop(queue)
            if k == b:
                return gone
            if gone > best[k]:
                continue
            for other in self.neighbours[k]:
                further = gone + self.length(k, other)
                if further <= most and further < best.get(other, math.inf):
                    best[other] = further
                    heapq.heappush(queue, (further, other))
        return math.inf
