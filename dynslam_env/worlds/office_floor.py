"""OfficeFloor: a random floor plan of an office, and a tour through all its rooms."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dynslam_env.worlds.clearance import clear, clear_of_legs, legs, sweep
from dynslam_env.worlds.floor_plan import Doorway, FloorPlan, Wall
from dynslam_env.worlds.outline import Rect
from dynslam_env.worlds.rooms import Pair, neighbours, spanning_tree, split_into_rooms
from dynslam_env.worlds.tour import tour
from slam.geometry import Array

MAX_DOOR_TRIES = 8  # positions tried for a door between two rooms
SWEEP_CLEARANCE = 0.1  # m, between the areas that two leaves sweep


class FloorDimensions(NamedTuple):
    """Dimensions of a floor, m.

    area            to be split into rooms
    room_side       least side of a room
    door_width      of the openings between the jambs
    door_thickness  of the leaves
    wall_thickness  of the walls between rooms
    clearance       least length of wall on each side of an opening
    free_way        distance from the tour that leaves keep
    """

    area: Rect
    room_side: float
    door_width: float
    door_thickness: float
    wall_thickness: float
    clearance: float
    free_way: float


class OfficeFloor(NamedTuple):
    """A floor plan, and waypoints (p, 2), m, of a tour through all its rooms and back."""

    plan: FloorPlan
    path: Array


def draw_floor(dimensions: FloorDimensions, rng: np.random.Generator) -> OfficeFloor | None:
    """Rooms joined by a spanning tree of open doorways, and doors where leaves swing freely.

    None if doorways cannot join all rooms.
    """
    rooms = split_into_rooms(dimensions.area, dimensions.room_side, dimensions.wall_thickness, rng)
    shared = dimensions.door_width + 2 * dimensions.clearance
    walls = neighbours(rooms, dimensions.wall_thickness, shared)
    all_pairs = list(walls)
    pairs = [all_pairs[i] for i in rng.permutation(len(walls)).tolist()]
    tree = spanning_tree(pairs, len(rooms))
    if len(tree) < len(rooms) - 1:
        return None
    ways = [
        Doorway(pair, _start(walls[pair], dimensions, rng), dimensions.door_width) for pair in tree
    ]
    joined = FloorPlan.known(tuple(rooms), tuple(ways), dimensions.door_thickness, walls)
    path = np.array(tour(joined, int(rng.integers(len(rooms)))))
    others = {pair: walls[pair] for pair in pairs if pair not in tree}
    doors = _place_doors(joined, others, legs(path), dimensions, rng)
    return OfficeFloor(joined.with_doorways((*ways, *doors)), path)


def _place_doors(
    plan: FloorPlan,
    walls: dict[Pair, Wall],
    way: Array,
    dimensions: FloorDimensions,
    rng: np.random.Generator,
) -> list[Doorway]:
    """Doors in those walls where a free position was found."""
    doors: list[Doorway] = []
    sweeps: list[Array] = []
    for pair, wall in walls.items():
        for _ in range(MAX_DOOR_TRIES):
            start, into, at_start = _start(wall, dimensions, rng), rng.random(), rng.random() < 0.5
            door = Doorway(pair, start, dimensions.door_width, pair[into < 0.5], at_start)
            swept = sweep(plan.leaf(door))
            if clear_of_legs(swept, way, dimensions.free_way) and all(
                clear(swept, other, SWEEP_CLEARANCE) for other in sweeps
            ):
                doors.append(door)
                sweeps.append(swept)
                break
    return doors


def _start(wall: Wall, dimensions: FloorDimensions, rng: np.random.Generator) -> float:
    """Random start of an opening in a wall, m along it."""
    margin = dimensions.clearance
    least = wall.start + margin
    return least + (wall.stop - margin - dimensions.door_width - least) * rng.random()
