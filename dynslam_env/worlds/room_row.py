"""Row: rooms side by side behind one wall, a door of its own to each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dynslam_env.worlds.floor_plan import Doorway
from dynslam_env.worlds.outline import Rect


class RoomDimensions(NamedTuple):
    """What the rooms of a row have in common, m.

    door_width  of the openings
    clearance   wall left and right of an opening at least
    partition   thickness of the walls between rooms
    """

    door_width: float
    clearance: float
    partition: float

    def spare(self, length: float, count: int) -> float:
        """How much longer a wall of `length` is than what `count` doors need, m."""
        return length - count * (self.door_width + 2 * self.clearance)


class RoomRow(NamedTuple):
    """Rooms along a wall, m from its beginning.

    starts    where the openings begin
    at_start  which of their leaves are hinged there
    rooms     from where to where each room reaches
    """

    starts: list[float]
    at_start: list[bool]
    rooms: list[tuple[float, float]]


def draw_row(rng: np.random.Generator, length: float, count: int, frame: RoomDimensions) -> RoomRow:
    """Rooms from end to end of a wall, with doors at uneven spacing, hinged at random."""
    gaps = frame.spare(length, count) * rng.dirichlet(np.full(count + 1, 2.0))[:count]
    pitch = frame.door_width + 2 * frame.clearance
    starts = (np.cumsum(gaps) + np.arange(count) * pitch + frame.clearance).tolist()
    at_start = (rng.random(count) < 0.5).tolist()
    stops = [start + frame.door_width for start in starts]
    middles = [(a + b) / 2 for a, b in zip(stops, starts[1:], strict=False)]
    lefts = [0.0, *(m + frame.partition / 2 for m in middles)]
    rights = [*(m - frame.partition / 2 for m in middles), length]
    return RoomRow(starts, at_start, list(zip(lefts[:count], rights[:count], strict=True)))


class RowPlacement(NamedTuple):
    """Where a row of rooms stands.

    level   its wall runs along x, else along y
    begin   m along the wall, where the row begins
    near    m across the wall, where the rooms begin
    far     m across the wall, where they end; less than `near` for rooms on the low side
    """

    level: bool
    begin: float
    near: float
    far: float


def build(
    row: RoomRow, site: RowPlacement, passage: int, first: int, width: float
) -> tuple[list[Rect], list[Doorway]]:
    """The rooms of a row, numbered from `first`, and their doorways from the space `passage`."""
    low, high = sorted((site.near, site.far))
    spans = [(site.begin + left, site.begin + right) for left, right in row.rooms]
    rooms = [Rect(a, low, b, high) if site.level else Rect(low, a, high, b) for a, b in spans]
    doorways = [
        Doorway((passage, room), site.begin + start, width, room, hinged)
        for room, (start, hinged) in enumerate(zip(row.starts, row.at_start, strict=True), first)
    ]
    return rooms, doorways
