"""Loop: four corridors around a block; the path closes a loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynslam_env.worlds.floor_plan import Doorway, FloorPlan
from dynslam_env.worlds.layout import Layout
from dynslam_env.worlds.outline import Rect
from dynslam_env.worlds.plan_variety import Stands, check_sizes, doubled, narrowed, sliding
from dynslam_env.worlds.room_row import RoomDimensions, RowPlacement, build, draw_row
from dynslam_env.worlds.routes import check_rooms, draw_routes
from slam.errors import InputError
from slam.geometry import Pose2
from slam.validation import positive, whole, within

SOUTH, EAST, NORTH, WEST = range(4)  # indices of the corridors among the spaces


@dataclass(frozen=True)
class Loop:
    """Four corridors around a rectangular block, with rooms outside and in the block.

    length           m, of the ring along x, between its outer walls
    breadth          m, of the ring along y
    width            m, of the corridors
    outer_doors      doors on each of the four outer sides, each to a room outside the ring
    inner_doors      doors on the southern and on the northern side of the block, each to a room
    door_width       m, of the opening between the jambs
    door_thickness   m, of the leaf
    wall_thickness   m, of the walls along the corridors; the leaves hang in the middle of them
    partition        m, thickness of the walls between rooms
    room_depth       m, of the rooms outside
    clearance        m, least length of wall on each side of an opening
    laps             number of laps of the path
    people           number of people, each of whom walks back and forth between two rooms
    furniture        pieces per room, fewer where no more fit
    narrowest        narrowest door, as a share of door_width; 1: all are as wide
    cut              m, longest side of the corners that oblique walls cut off; 0: none
    doubled          share of the doors that have two leaves, where these swing clear
    sliding          share of the doors that slide into the wall, where it has room for them
    """

    length: float = 14.0
    breadth: float = 10.0
    width: float = 2.0
    outer_doors: int = 3
    inner_doors: int = 2
    door_width: float = 0.9
    door_thickness: float = 0.04
    wall_thickness: float = 0.2
    partition: float = 0.1
    room_depth: float = 3.0
    clearance: float = 0.25
    laps: int = 1
    people: int = 0
    furniture: int = 0
    narrowest: float = 1.0
    cut: float = 0.0
    doubled: float = 0.0
    sliding: float = 0.0

    def __post_init__(self) -> None:
        positive(self, "length", "breadth", "width", "door_width", "door_thickness")
        positive(self, "wall_thickness", "partition", "room_depth")
        for field, low in (("outer_doors", 0), ("inner_doors", 0), ("laps", 1), ("people", 0)):
            whole(self, field, low)
        whole(self, "furniture", 0)
        check_sizes(self, "room_depth", "partition")
        within(self, "clearance", self.partition)
        self._check_sides()
        if self.people:
            self._check_people()

    def _check_sides(self) -> None:
        block = self._block
        if min(block.right - block.left, block.top - block.bottom) <= 2 * self.wall_thickness:
            raise InputError(
                f"Loop.length and Loop.breadth must leave a block between corridors of "
                f"{self.width:g} m, got {self.length:g} x {self.breadth:g} m"
            )
        shortest = min(self.length, self.breadth) - self.width
        for name, length in (("outer_doors", shortest), ("inner_doors", self._inner_length)):
            count = getattr(self, name)
            if count and self._dimensions.spare(length, count) < 0:
                raise InputError(
                    f"Loop.{name}: {count} doors of {self.door_width:g} m with "
                    f"{self.clearance:g} m of wall beside each need more than a side's "
                    f"{length:g} m"
                )
        if self.inner_doors and self._inner_depth < self.door_width:
            raise InputError(
                f"rooms in the block must be at least as deep as a door is wide, "
                f"{self.door_width:g} m, got {self._inner_depth:g} m: Loop.breadth is too small, "
                "or set inner_doors = 0"
            )

    def _check_people(self) -> None:
        if self.outer_doors + self.inner_doors == 0:
            raise InputError("people walk from room to room: they need outer_doors or inner_doors")
        depths = [self.room_depth] * bool(self.outer_doors)
        depths += [self._inner_depth] * bool(self.inner_doors)
        check_rooms(self.people, min(depths), self.door_width)

    @property
    def _dimensions(self) -> RoomDimensions:
        return RoomDimensions(self.door_width, self.clearance, self.partition)

    @property
    def _block(self) -> Rect:
        """The area that the corridors enclose, with its walls."""
        return Rect(self.width, self.width, self.length - self.width, self.breadth - self.width)

    @property
    def _inner_length(self) -> float:
        return self.length - 2 * (self.width + self.wall_thickness)

    @property
    def _inner_depth(self) -> float:
        """Depth in m of a room in the block, which has two rows of rooms back to back."""
        inner = self.breadth - 2 * (self.width + self.wall_thickness)
        return (inner - self.partition) / 2

    def layout(self, rng: np.random.Generator) -> Layout:
        """A layout with random door positions and sides of the hinges."""
        plan = narrowed(self._plan(rng), self.narrowest, rng)
        x1, y1 = self.width / 2, self.width / 2
        x2, y2 = self.length - x1, self.breadth - y1
        lap = [(x2, y1), (x2, y2), (x1, y2), (x1, y1)]
        path, rooms = np.array([(x1, y1), *(lap * self.laps)]), range(4, len(plan.spaces))
        plan = doubled(plan, self.doubled, path, rng)
        plan = sliding(plan, self.sliding, rng)
        stands = Stands(self.cut, self.furniture)
        clutter = stands.draw(plan, rooms, path, rng)
        routes = draw_routes(plan, rooms, self.people, rng, (x1, y1), clutter.solids)
        return Layout.known(clutter.walls(plan), plan.doors, Pose2(x1, y1, 0.0), path, routes)

    def _plan(self, rng: np.random.Generator) -> FloorPlan:
        """The corridors are spaces 0 to 3, the rooms follow."""
        spaces, doorways = self._ring()
        for corridor, placement, length, count in self._sides():
            row = draw_row(rng, length, count, self._dimensions)
            rooms, doors = build(row, placement, corridor, len(spaces), self.door_width)
            spaces, doorways = spaces + rooms, doorways + doors
        return FloorPlan(tuple(spaces), tuple(doorways), self.door_thickness)

    def _ring(self) -> tuple[list[Rect], list[Doorway]]:
        """The corridors, each with the corner at its end, and the openings between them."""
        block, x, y = self._block, self.length, self.breadth
        corridors = [
            Rect(0.0, 0.0, block.right, block.bottom),
            Rect(block.right, 0.0, x, block.top),
            Rect(block.left, block.top, x, y),
            Rect(0.0, block.bottom, block.left, y),
        ]
        spans = (0.0, block.bottom), (block.right, x), (block.top, y), (0.0, block.left)
        joints = [
            Doorway((side, (side + 1) % 4), start, stop - start)
            for side, (start, stop) in enumerate(spans)
        ]
        return corridors, joints

    def _sides(self) -> list[tuple[int, RowPlacement, float, int]]:
        """Corridor, placement, length in m and number of doors of each row of rooms."""
        wall, deep, block = self.wall_thickness, self.wall_thickness + self.room_depth, self._block
        outer, inner = self.outer_doors, self.inner_doors
        begin, inner_far = block.left + wall, wall + self._inner_depth
        x, y = self.length, self.breadth
        return [
            (SOUTH, RowPlacement(True, 0.0, -wall, -deep), block.right, outer),
            (EAST, RowPlacement(False, 0.0, x + wall, x + deep), block.top, outer),
            (NORTH, RowPlacement(True, block.left, y + wall, y + deep), x - block.left, outer),
            (WEST, RowPlacement(False, block.bottom, -wall, -deep), y - block.bottom, outer),
            (SOUTH, RowPlacement(True, begin, block.bottom + wall, block.bottom + inner_far),
             self._inner_length, inner),
            (NORTH, RowPlacement(True, begin, block.top - wall, block.top - inner_far),
             self._inner_length, inner),
        ]  # fmt: skip
