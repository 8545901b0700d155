"""Random partition of a rectangle into rooms, and the spanning tree that joins them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynslam_env.worlds.floor_plan import Wall, wall_between
from dynslam_env.worlds.outline import Rect
from slam.kernel import kernel

MAX_ASPECT_RATIO = 1.3  # a room that exceeds it is split across its longer side, if possible
MAX_SIDE_RATIO = 2.6  # a room with a side longer than this times the least side is always split
KEEP_PROBABILITY = 0.35  # that a smaller room is not split

Pair = tuple[int, int]


def split_into_rooms(whole: Rect, side: float, wall: float, rng: np.random.Generator) -> list[Rect]:
    """Split `whole` into rooms with sides of at least `side` m and walls of `wall` m between them.

    Random binary space partitioning.
    """
    return [Rect(*room) for room in _split(np.array(whole), side, wall, rng).tolist()]


@kernel
def _split(whole, side, wall, rng):
    """(n, 4) the rooms; those in `rooms` are still to be split, the last one first."""
    most = (whole[2:] - whole[:2]) / side + 1.0
    rooms = np.empty((int(most[0]) * int(most[1]) + 1, 4))
    found, left = np.empty_like(rooms), 1
    rooms[0], count = whole, 0
    while left:
        left -= 1
        room = rooms[left].copy()
        sizes = room[2:] - room[:2]
        longer = 0 if sizes[0] > sizes[1] else 1
        can = sizes >= 2 * side + wall
        small = sizes.max() < MAX_SIDE_RATIO * side
        if not can.any() or (small and rng.random() < KEEP_PROBABILITY):
            found[count] = room
            count += 1
            continue
        axis = rng.integers(0, 2) if can.all() else int(can[1])
        if can[longer] and sizes[longer] > MAX_ASPECT_RATIO * sizes[1 - longer]:
            axis = longer
        end = room[axis] + rng.uniform(side, sizes[axis] - side - wall)
        rooms[left] = rooms[left + 1] = room
        rooms[left, axis], rooms[left + 1, axis + 2] = end + wall, end
        left += 2
    return found[:count]


def neighbours(rooms: Sequence[Rect], wall: float, shared: float) -> dict[Pair, Wall]:
    """The walls of `wall` m between pairs of rooms that share at least `shared` m of it."""
    all_rooms, far, walls = tuple(rooms), 2 * wall, {}
    near = [(a - far, b - far, c + far, d + far) for a, b, c, d in all_rooms]
    for j, (left, bottom, right, top) in enumerate(near):
        for i in range(j):
            left_i, bottom_i, right_i, top_i = near[i]
            if left < right_i and left_i < right and bottom < top_i and bottom_i < top:
                each = wall_between(all_rooms, i, j)
                if each and each.high - each.low < 1.5 * wall and each.stop - each.start >= shared:
                    walls[i, j] = each
    return walls


def spanning_tree(pairs: Sequence[Pair], count: int) -> list[Pair]:
    """The first pairs that join all rooms without a cycle (Kruskal 1956).

    Fewer than count - 1 if the pairs do not join all rooms.
    """
    component = list(range(count))
    tree = []
    for a, b in pairs:
        if component[a] != component[b]:
            tree.append((a, b))
            component = [component[a] if c == component[b] else c for c in component]
    return tree
