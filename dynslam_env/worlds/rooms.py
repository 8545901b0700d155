"""Rooms: a rectangle cut into rooms at random, and the trees of ways that join them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynslam_env.worlds.floor_plan import Wall, wall_between
from dynslam_env.worlds.outline import Rect

LONG = 1.3  # a room this much longer than wide is cut across
LARGE = 2.6  # in shortest sides: a room with a longer side is always cut
KEEP = 0.35  # probability that a smaller one stays whole

Pair = tuple[int, int]


def cut(whole: Rect, side: float, wall: float, rng: np.random.Generator) -> list[Rect]:
    """`whole` in rooms with sides of at least `side` m, walls of `wall` m between them.

    Random binary space partition: a room is cut in two wherever there is space, and so on.
    """
    sizes = whole.right - whole.left, whole.top - whole.bottom
    axes = [axis for axis in (0, 1) if sizes[axis] >= 2 * side + wall]
    if not axes or (max(sizes) < LARGE * side and rng.random() < KEEP):
        return [whole]
    longer = 0 if sizes[0] > sizes[1] else 1
    axis = int(rng.choice(axes))
    if longer in axes and sizes[longer] > LONG * sizes[1 - longer]:
        axis = longer
    end = whole[axis] + rng.uniform(side, sizes[axis] - side - wall)
    first, second = list(whole), list(whole)
    first[axis + 2], second[axis] = end, end + wall
    return [*cut(Rect(*first), side, wall, rng), *cut(Rect(*second), side, wall, rng)]


def neighbours(rooms: Sequence[Rect], wall: float, shared: float) -> dict[Pair, Wall]:
    """The pairs of rooms with a wall of `wall` m between them, along at least `shared` m."""
    pairs = ((i, j) for j in range(len(rooms)) for i in range(j))
    walls = {pair: wall_between(tuple(rooms), *pair) for pair in pairs}
    return {
        pair: each
        for pair, each in walls.items()
        if each and each.high - each.low < 1.5 * wall and each.stop - each.start >= shared
    }


def spanning_tree(pairs: Sequence[Pair], count: int) -> list[Pair]:
    """The first of the `pairs` that join all rooms without a circle (Kruskal 1956).

    Fewer than count - 1 of them if the rooms cannot all be joined.
    """
    group = list(range(count))
    tree = []
    for a, b in pairs:
        if group[a] != group[b]:
            tree.append((a, b))
            group = [group[a] if each == group[b] else each for each in group]
    return tree
