"""A floor of an office, drawn at random: rooms, open doorways, doors, and a tour through all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dynslam_env.worlds.clearance import clear, clear_of_legs, legs, sweep
from dynslam_env.worlds.floor_plan import Doorway, FloorPlan, Wall
from dynslam_env.worlds.outline import Rect
from dynslam_env.worlds.rooms import Pair, cut, neighbours, spanning_tree
from dynslam_env.worlds.tour import tour
from slam.geometry import Array

PLACES = 8  # tried for a leaf between two rooms
SWEEPS_APART = 0.1  # m


class FloorDimensions(NamedTuple):
    """Of a floor, m.

    area            to be cut into rooms
    room_side       shortest of a room
    door_width      of the openings between the jambs
    door_thickness  of the leaves
    wall_thickness  of the walls between rooms
    clearance       wall left and right of an opening at least
    free_way        on either side of the tour, where no leaf swings
    """

    area: Rect
    room_side: float
    door_width: float
    door_thickness: float
    wall_thickness: float
    clearance: float
    free_way: float


class OfficeFloor(NamedTuple):
    """A plan, and waypoints (p, 2), m, of a tour through all its rooms and back."""

    plan: FloorPlan
    path: Array


def draw_floor(sizes: FloorDimensions, rng: np.random.Generator) -> OfficeFloor | None:
    """Rooms joined by a tree of open doorways, and by doors wherever their leaves swing freely.

    None if the rooms came out such that no doorways join them all.
    """
    rooms = cut(sizes.area, sizes.room_side, sizes.wall_thickness, rng)
    shared = sizes.door_width + 2 * sizes.clearance
    walls = neighbours(rooms, sizes.wall_thickness, shared)
    pairs = [list(walls)[i] for i in rng.permutation(len(walls))]
    tree = spanning_tree(pairs, len(rooms))
    if len(tree) < len(rooms) - 1:
        return None
    ways = [Doorway(pair, _start(walls[pair], sizes, rng), sizes.door_width) for pair in tree]
    joined = FloorPlan(tuple(rooms), tuple(ways), sizes.door_thickness)
    path = np.array(tour(joined, int(rng.integers(len(rooms)))))
    others = {pair: walls[pair] for pair in pairs if pair not in tree}
    doors = _hang(joined, others, legs(path), sizes, rng)
    return OfficeFloor(FloorPlan(joined.spaces, (*ways, *doors), sizes.door_thickness), path)


def _hang(
    plan: FloorPlan,
    walls: dict[Pair, Wall],
    way: Array,
    sizes: FloorDimensions,
    rng: np.random.Generator,
) -> list[Doorway]:
    """Doors in those of the walls where a place for one is found."""
    doors: list[Doorway] = []
    sweeps: list[Array] = []
    for pair, wall in walls.items():
        for _ in range(PLACES):
            start, into, at_start = _start(wall, sizes, rng), rng.random(), rng.random() < 0.5
            door = Doorway(pair, start, sizes.door_width, pair[into < 0.5], at_start)
            swept = sweep(plan.leaf(door))
            if clear_of_legs(swept, way, sizes.free_way) and all(
                clear(swept, other, SWEEPS_APART) for other in sweeps
            ):
                doors.append(door)
                sweeps.append(swept)
                break
    return doors


def _start(wall: Wall, sizes: FloorDimensions, rng: np.random.Generator) -> float:
    """Where an opening in a wall begins, m along it."""
    margin = sizes.clearance
    return rng.uniform(wall.start + margin, wall.stop - margin - sizes.door_width)
