"""Office: a random floor of rooms and doors, drawn anew in each episode."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dynslam_env.worlds.floor_plan import FloorPlan
from dynslam_env.worlds.layout import Layout
from dynslam_env.worlds.office_floor import FloorDimensions, OfficeFloor, draw_floor
from dynslam_env.worlds.outline import Rect
from dynslam_env.worlds.plan_variety import Stands, check_sizes, doubled, narrowed, sliding
from dynslam_env.worlds.routes import check_rooms, draw_routes
from slam.errors import InputError
from slam.geometry import Pose2
from slam.validation import positive, whole, within

MAX_FLOOR_TRIES = 100  # floors drawn until one has enough doors


@dataclass(frozen=True)
class Office:
    """Random rooms, all joined by open doorways; doors are short cuts that open and close.

    length           m, of the floor along x, within its outer walls
    breadth          m, of the floor along y
    room_side        m, least side of a room
    doors            number of doors; a floor with fewer is drawn again, surplus ones are left out
    door_width       m, of the openings between the jambs
    door_thickness   m, of the leaves
    wall_thickness   m, of the walls between rooms; the leaves hang in the middle of them
    clearance        m, least length of wall on each side of an opening
    free_way         m, distance that furniture and leaves keep from the path and from the ways
                     through doorways: the robot's radius plus its deviation from the path
    floor            a seed: the same floor in every episode; None: a new one in each
    furniture        pieces per room, placed anew in every episode; fewer where no more fit
    people           number of people, each of whom walks back and forth between two rooms
    narrowest        narrowest door, as a share of door_width; 1: all are as wide
    cut              m, longest side of the corners that oblique walls cut off; 0: none
    doubled          share of the doors that have two leaves, where these swing clear
    sliding          share of the doors that slide into the wall, where it has room for them
    """

    length: float = 16.0
    breadth: float = 11.0
    room_side: float = 2.8
    doors: int = 5
    door_width: float = 0.9
    door_thickness: float = 0.04
    wall_thickness: float = 0.2
    clearance: float = 0.25
    free_way: float = 0.47
    floor: int | None = None
    furniture: int = 0
    people: int = 0
    narrowest: float = 1.0
    cut: float = 0.0
    doubled: float = 0.0
    sliding: float = 0.0

    def __post_init__(self) -> None:
        positive(self, "length", "breadth", "room_side", "door_width", "door_thickness")
        positive(self, "wall_thickness", "free_way")
        for field in ("doors", "furniture", "people"):
            whole(self, field, 0)
        if self.floor is not None:
            whole(self, "floor", 0)
        check_sizes(self, "room_side", "free_way")
        within(self, "clearance", 0.0)
        check_rooms(self.people, self.room_side, self.door_width)
        self._check_rooms()

    def _check_rooms(self) -> None:
        opening = self.door_width + 2 * self.clearance
        if self.room_side < opening:
            raise InputError(
                f"Office.room_side must be at least {opening:g} m, a door of {self.door_width:g} m "
                f"and {self.clearance:g} m of wall beside it, got {self.room_side:g}"
            )
        long, short = max(self.length, self.breadth), min(self.length, self.breadth)
        two = 2 * self.room_side + self.wall_thickness
        if long < two or short < self.room_side:
            raise InputError(
                f"two rooms of {self.room_side:g} m at least need a floor of {two:g} x "
                f"{self.room_side:g} m, Office has {self.length:g} x {self.breadth:g} m"
            )

    def layout(self, rng: np.random.Generator) -> Layout:
        """A layout whose path leads from the middle of a room through all rooms and back."""
        plan, path = self._floor(rng if self.floor is None else np.random.default_rng(self.floor))
        plan = doubled(plan, self.doubled, path, rng)
        plan = sliding(plan, self.sliding, rng)
        (x, y), (x2, y2) = path[:2].tolist()
        rooms = range(len(plan.spaces))
        stands = Stands(self.cut, self.furniture, self.free_way)
        clutter = stands.draw(plan, rooms, path, rng)
        routes = draw_routes(plan, rooms, self.people, rng, (x, y), clutter.solids)
        start = Pose2(x, y, math.atan2(y2 - y, x2 - x))
        return Layout.known(clutter.walls(plan), plan.doors, start, path, routes)

    def _floor(self, rng: np.random.Generator) -> OfficeFloor:
        area = Rect(0.0, 0.0, self.length, self.breadth)
        dimensions = FloorDimensions(area, self.room_side, self.door_width, self.door_thickness,
                      self.wall_thickness, self.clearance, self.free_way)  # fmt: skip
        for _ in range(MAX_FLOOR_TRIES):
            floor = draw_floor(dimensions, rng)
            if floor and len(floor.plan.spaces) > 1 and floor.plan.leaf_count >= self.doors:
                return floor._replace(
                    plan=narrowed(self._with_doors(floor.plan), self.narrowest, rng)
                )
        raise InputError(
            f"none of {MAX_FLOOR_TRIES} floors of {self.length:g} x {self.breadth:g} m with rooms "
            f"of at least {self.room_side:g} m had Office.doors = {self.doors} doors whose leaves "
            "swing clear of the path; make the floor larger, or doors fewer"
        )

    def _with_doors(self, plan: FloorPlan) -> FloorPlan:
        """The plan with `doors` doors; its open doorways come first."""
        kept = plan.doorways[: len(plan.doorways) - plan.leaf_count + self.doors]
        return plan.with_doorways(kept)
