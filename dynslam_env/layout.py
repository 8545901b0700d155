"""Worlds: a generator draws a Layout (walls, doors, start, path) from a configuration.

`Corridor` is the paper's short passage: doors on both sides at uneven spacing, a room behind each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from slam.checked import finite, positive, whole, within
from slam.errors import InputError
from slam.geometry import Array, Pose2

LATCH_GAP = 0.002  # m between a closed leaf and the jamb, so that its outer corner can pass


class Door(NamedTuple):
    """A hinged leaf. It turns about `hinge`, a corner of the leaf on the side to which it opens.

    hinge      (x, y) in m, world
    closed     rad, direction from the hinge along the closed leaf, world
    swing      +1 opens counter-clockwise, -1 clockwise
    width      m, hinge to the free edge
    thickness  m, away from the side to which it opens
    """

    hinge: tuple[float, float]
    closed: float
    swing: int
    width: float
    thickness: float

    @property
    def corners(self) -> Array:
        """(4, 2) of the leaf, m, in its own frame: origin at the hinge, x along the leaf."""
        w, t = self.width, -self.swing * self.thickness
        return np.array([(0.0, 0.0), (w, 0.0), (w, t), (0.0, t)])


@dataclass(frozen=True)
class Layout:
    """A world that can be driven in.

    walls  (w, 4) segments x1, y1, x2, y2, m
    doors  hinged leaves
    start  the robot at the beginning
    path   (p, 2) waypoints of the drive, m
    """

    walls: Array
    doors: tuple[Door, ...]
    start: Pose2
    path: Array

    def __post_init__(self) -> None:
        finite("Layout.walls", self.walls, 4)
        finite("Layout.path", self.path, 2)
        finite("Layout.start", self.start)
        for door in self.doors:
            finite("a door of Layout.doors", (*door.hinge, *door[1:]))
        if not len(self.path):
            raise InputError("Layout.path needs at least one waypoint, got none")


@runtime_checkable
class Generator(Protocol):
    """Anything that draws a layout."""

    def layout(self, rng: np.random.Generator) -> Layout:
        """A new layout; the same state of `rng`, the same layout."""
        ...


@dataclass(frozen=True)
class Corridor:
    """A straight passage along x with rooms on both sides, closed at both ends.

    length           m, of the passage
    width            m, of the passage
    doors_per_side   doors on each side
    door_width       m, of the opening between the jambs
    door_thickness   m, of the leaf
    wall_thickness   m, of the wall between passage and rooms; the leaf hangs in the middle of it
    partition        m, thickness of the walls between rooms
    room_depth       m
    clearance        m, wall left and right of an opening at least
    margin           m, from the ends of the passage to the ends of the path
    """

    length: float = 12.0
    width: float = 2.0
    doors_per_side: int = 4
    door_width: float = 0.9
    door_thickness: float = 0.04
    wall_thickness: float = 0.2
    partition: float = 0.1
    room_depth: float = 3.0
    clearance: float = 0.25
    margin: float = 0.8

    def __post_init__(self) -> None:
        positive(self, "length", "width", "door_width", "door_thickness", "wall_thickness")
        positive(self, "partition", "room_depth")
        whole(self, "doors_per_side", 0)
        within(self, "door_thickness", 0.0, self.wall_thickness)
        within(self, "clearance", self.partition)
        within(self, "margin", 0.0, self.length / 2)
        if self._spare < 0:
            raise InputError(
                f"{self.doors_per_side} doors of {self.door_width:g} m with {self.clearance:g} m "
                f"of wall beside each need more than the corridor's {self.length:g} m"
            )

    @property
    def _spare(self) -> float:
        return self.length - self.doors_per_side * (self.door_width + 2 * self.clearance)

    def layout(self, rng: np.random.Generator) -> Layout:
        """Each side has gaps of its own between its doors, and hinges left or right."""
        walls, doors = self._ends(), []
        for side in (1, -1):
            starts, hinges_left = self._openings(rng)
            walls += self._side_walls(side, starts)
            doors += [
                self._door(side, x, left) for x, left in zip(starts, hinges_left, strict=True)
            ]
        ends = (self.margin, 0.0), (self.length - self.margin, 0.0)
        path = np.array([*ends, ends[0]])
        return Layout(np.array(walls), tuple(doors), Pose2(*ends[0], 0.0), path)

    def _openings(self, rng: np.random.Generator) -> tuple[list[float], list[bool]]:
        """Where the openings of one side begin, m along x, and which are hinged there."""
        n = self.doors_per_side
        gaps = self._spare * rng.dirichlet(np.full(n + 1, 2.0))[:n]
        pitch = self.door_width + 2 * self.clearance
        starts = np.cumsum(gaps) + np.arange(n) * pitch + self.clearance
        return starts.tolist(), (rng.random(n) < 0.5).tolist()

    def _ends(self) -> list[tuple[float, float, float, float]]:
        y = self.width / 2
        return [(0.0, -y, 0.0, y), (self.length, -y, self.length, y)]

    def _side_walls(self, side: int, starts: list[float]) -> list[tuple[float, ...]]:
        inner = side * self.width / 2
        outer = inner + side * self.wall_thickness
        far = outer + side * self.room_depth
        stops = [start + self.door_width for start in starts]
        middles = [(a + b) / 2 for a, b in zip(stops, starts[1:], strict=False)]
        lefts = [0.0, *(m + self.partition / 2 for m in middles)]
        rights = [*(m - self.partition / 2 for m in middles), self.length]
        walls = [
            (a, inner, b, inner) for a, b in zip([0.0, *stops], [*starts, self.length], strict=True)
        ]
        for start, stop, left, right in zip(starts, stops, lefts, rights, strict=False):
            walls += [(start, inner, start, outer), (stop, inner, stop, outer)]
            walls += [(left, outer, start, outer), (stop, outer, right, outer)]
            walls += [(left, outer, left, far), (right, outer, right, far), (left, far, right, far)]
        return walls

    def _door(self, side: int, start: float, hinged_left: bool) -> Door:
        y = side * (self.width + self.wall_thickness + self.door_thickness) / 2
        leaf = self.door_width - LATCH_GAP
        if hinged_left:
            return Door((start, y), 0.0, side, leaf, self.door_thickness)
        return Door((start + self.door_width, y), math.pi, -side, leaf, self.door_thickness)
