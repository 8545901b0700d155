"""RoomRow: rooms side by side along a wall, each with a door in it."""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import numpy as np

from dynslam_env.worlds.floor_plan import Doorway
from dynslam_env.worlds.outline import Rect


class RoomDimensions(NamedTuple):
    """Dimensions shared by the rooms of a row, m.

    door_width  of the openings
    clearance   least length of wall on each side of an opening
    partition   thickness of the walls between rooms
    """

    door_width: float
    clearance: float
    partition: float

    def spare(self, length: float, count: int) -> float:
        """Length in m that `count` doors leave of a wall of `length` m."""
        return length - count * (self.door_width + 2 * self.clearance)


class RoomRow(NamedTuple):
    """Rooms along a wall, in m from its start.

    starts    start of each opening
    at_start  whether the leaf is hinged there, or at the other end
    rooms     start and end of each room
    """

    starts: list[float]
    at_start: list[bool]
    rooms: list[tuple[float, float]]


def draw_row(
    rng: np.random.Generator, length: float, count: int, dimensions: RoomDimensions
) -> RoomRow:
    """Rooms along a whole wall, with random door positions and sides of the hinges."""
    gaps = dimensions.spare(length, count) * rng.dirichlet((2.0,) * (count + 1))
    pitch = dimensions.door_width + 2 * dimensions.clearance
    before = accumulate(gaps.tolist()[:count])
    starts = [gap + k * pitch + dimensions.clearance for k, gap in enumerate(before)]
    at_start = (rng.random(count) < 0.5).tolist()
    stops = [start + dimensions.door_width for start in starts]
    middles = [(a + b) / 2 for a, b in zip(stops, starts[1:], strict=False)]
    lefts = [0.0, *(m + dimensions.partition / 2 for m in middles)]
    rights = [*(m - dimensions.partition / 2 for m in middles), length]
    return RoomRow(starts, at_start, list(zip(lefts[:count], rights[:count], strict=True)))


class RowPlacement(NamedTuple):
    """Position of a row of rooms.

    level   whether its wall runs along x, else along y
    begin   m along the wall, start of the row
    near    m across the wall, near side of the rooms
    far     m across the wall, far side; less than `near` for rooms on the low side
    """

    level: bool
    begin: float
    near: float
    far: float


def build(
    row: RoomRow, placement: RowPlacement, passage: int, first: int, width: float
) -> tuple[list[Rect], list[Doorway]]:
    """Spaces of the rooms, with indices from `first`, and their doorways to the space `passage`."""
    low, high = sorted((placement.near, placement.far))
    spans = [(placement.begin + left, placement.begin + right) for left, right in row.rooms]
    rooms = [Rect(a, low, b, high) if placement.level else Rect(low, a, high, b) for a, b in spans]
    doorways = [
        Doorway((passage, room), placement.begin + start, width, room, hinged)
        for room, (start, hinged) in enumerate(zip(row.starts, row.at_start, strict=True), first)
    ]
    return rooms, doorways
