"""Corridor: the passage of the paper, with doors on both sides and a room behind each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynslam_env.worlds.floor_plan import FloorPlan
from dynslam_env.worlds.layout import Layout
from dynslam_env.worlds.outline import Rect
from dynslam_env.worlds.plan_variety import Stands, check_sizes, doubled, narrowed, sliding
from dynslam_env.worlds.room_row import RoomDimensions, RowPlacement, build, draw_row
from dynslam_env.worlds.routes import check_rooms, draw_routes
from slam.errors import InputError
from slam.geometry import Pose2
from slam.validation import positive, whole, within


@dataclass(frozen=True)
class Corridor:
    """A straight passage along x with rooms on both sides, closed at both ends.

    length           m, of the passage
    width            m, of the passage
    doors_per_side   doors on each side, at random distances
    door_width       m, of the opening between the jambs
    door_thickness   m, of the leaf
    wall_thickness   m, of the wall between passage and rooms; the leaf hangs in the middle of it
    partition        m, thickness of the walls between rooms
    room_depth       m
    clearance        m, least length of wall on each side of an opening
    margin           m, from the ends of the passage to the ends of the path
    people           number of people, each of whom walks back and forth between two rooms
    furniture        pieces per room, fewer where no more fit
    narrowest        narrowest door, as a share of door_width; 1: all are as wide
    cut              m, longest side of the corners that oblique walls cut off; 0: none
    doubled          share of the doors that have two leaves, where these swing clear
    sliding          share of the doors that slide into the wall, where it has room for them
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
    people: int = 0
    furniture: int = 0
    narrowest: float = 1.0
    cut: float = 0.0
    doubled: float = 0.0
    sliding: float = 0.0

    def __post_init__(self) -> None:
        positive(self, "length", "width", "door_width", "door_thickness", "wall_thickness")
        positive(self, "partition", "room_depth")
        whole(self, "doors_per_side", 0)
        whole(self, "people", 0)
        whole(self, "furniture", 0)
        check_sizes(self, "room_depth", "partition")
        within(self, "clearance", self.partition)
        within(self, "margin", 0.0, self.length / 2)
        if self._dimensions.spare(self.length, self.doors_per_side) < 0:
            raise InputError(
                f"{self.doors_per_side} doors of {self.door_width:g} m with {self.clearance:g} m "
                f"of wall beside each need more than the corridor's {self.length:g} m"
            )
        if self.people and not self.doors_per_side:
            raise InputError(
                "people walk from room to room: they need doors_per_side of at least 1"
            )
        check_rooms(self.people, self.room_depth, self.door_width)

    @property
    def _dimensions(self) -> RoomDimensions:
        return RoomDimensions(self.door_width, self.clearance, self.partition)

    def layout(self, rng: np.random.Generator) -> Layout:
        """A layout with random door positions and sides of the hinges."""
        plan = narrowed(self._plan(rng), self.narrowest, rng)
        ends = (self.margin, 0.0), (self.length - self.margin, 0.0)
        path = np.array([*ends, ends[0]])
        plan = doubled(plan, self.doubled, path, rng)
        plan = sliding(plan, self.sliding, rng)
        rooms = range(1, len(plan.spaces))
        stands = Stands(self.cut, self.furniture)
        clutter = stands.draw(plan, rooms, path, rng)
        routes = draw_routes(plan, rooms, self.people, rng, ends[0], clutter.solids)
        start = Pose2(float(self.margin), 0.0, 0.0)
        return Layout.known(clutter.walls(plan), plan.doors, start, path, routes)

    def _plan(self, rng: np.random.Generator) -> FloorPlan:
        """The passage is space 0, the rooms follow."""
        half = self.width / 2
        spaces, doorways = [Rect(0.0, -half, self.length, half)], []
        for side in (1, -1):
            row = draw_row(rng, self.length, self.doors_per_side, self._dimensions)
            near = side * half + side * self.wall_thickness
            placement = RowPlacement(True, 0.0, near, near + side * self.room_depth)
            rooms, doors = build(row, placement, 0, len(spaces), self.door_width)
            spaces, doorways = spaces + rooms, doorways + doors
        return FloorPlan.known(tuple(spaces), tuple(doorways), self.door_thickness)
