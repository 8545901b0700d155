"""Planner: the cheapest paths from the robot to all cells (Dijkstra 1959)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.costmap import OPEN, TIGHT, Costmap, Kinds
from slam.geometry import Array, Pose2
from slam.grid import GridSpec
from slam.kernel import kernel

NO_PARENT = -1
TIGHT_COST_FACTOR = 10.0  # for cells where the robot does not fit: it leaves them at once


class Plan(NamedTuple):
    """The cheapest paths from one cell.

    cost    (rows, cols) of the cheapest path; inf if unreachable
    length  (rows, cols) m, of the cheapest path; inf likewise
    parent  (rows, cols) int32, flat index of the cell before; NO_PARENT at the start and where no
            path leads
    """

    spec: GridSpec
    cost: Array
    length: Array
    parent: NDArray[np.int32]

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(rows, cols) cells to which a path leads."""
        return np.isfinite(self.cost)

    def path(self, cell: tuple[int, int]) -> Array:
        """(n, 2) m, the centres of the cells from the start to `cell`; (0, 2) if no path leads."""
        if not math.isfinite(self.cost[cell]):
            return np.empty((0, 2))
        cells = trace(self.parent.ravel(), cell[0] * self.spec.cols + cell[1])
        return self.spec.centres(np.column_stack(np.divmod(cells, self.spec.cols)))


def plan(costmap: Costmap, pose: Pose2) -> Plan:
    """The cheapest paths from the robot's cell.

    A move goes to one of eight neighbours and costs its length times the mean cost of both cells.
    Unknown and occupied cells are never entered. From a cell too near to an obstacle, a path may
    cross further such cells until it has left them; it does not enter any later.
    """
    spec = costmap.spec
    row, col = spec.cell(pose.x, pose.y)
    return Plan(spec, *_dijkstra(row, col, costmap.kinds, costmap.cost, spec.resolution))


def reached(spec: GridSpec, kinds: Kinds, pose: Pose2) -> NDArray[np.bool_]:
    """(rows, cols) the cells that `plan` reaches, by a flood without costs.

    kinds  (rows, cols) as those of a `Costmap`
    """
    row, col = spec.cell(pose.x, pose.y)
    found = np.zeros(spec.shape, dtype=np.bool_)
    if 0 <= row < spec.rows and 0 <= col < spec.cols:
        _flood(row, col, kinds, found)
    return found


@kernel
def _flood(row, col, kinds, found):
    """Mark the cells to which the moves of `plan` lead: open ones in runs along the rows."""
    rows, cols = kinds.shape
    stack = np.empty((rows * cols, 2), dtype=np.int32)
    stack[0, 0], stack[0, 1], size = row, col, 1
    found[row, col] = True
    while size:
        size -= 1
        r, first = stack[size]
        last, tight = first, kinds[r, first] != OPEN
        while not tight and first > 0 and kinds[r, first - 1] == OPEN and not found[r, first - 1]:
            first -= 1
            found[r, first] = True
        while not tight and last + 1 < cols and kinds[r, last + 1] == OPEN:
            if found[r, last + 1]:
                break
            last += 1
            found[r, last] = True
        for i in range(max(r - 1, 0), min(r + 2, rows)):
            before = False  # whether the cell before is open, and will find this one
            for j in range(max(first - 1, 0), min(last + 2, cols)):
                is_open = kinds[i, j] == OPEN
                if found[i, j] or not (is_open or (tight and kinds[i, j] == TIGHT)):
                    before = False
                    continue
                if not (before and is_open):
                    found[i, j] = True
                    stack[size, 0], stack[size, 1] = i, j
                    size += 1
                before = is_open


@kernel
def _dijkstra(row, col, kinds, price, cell):
    """(rows, cols) cost, length and parent, see `Plan`; nothing is reached from outside."""
    rows, cols = kinds.shape
    table = (np.full((rows, cols), np.inf), np.full((rows, cols), np.inf),
             np.full((rows, cols), NO_PARENT, np.int32))  # fmt: skip
    if not (0 <= row < rows and 0 <= col < cols):
        return table
    kinds, price = kinds.ravel(), price.ravel()
    cost, length, parent = table[0].ravel(), table[1].ravel(), table[2].ravel()
    done = np.zeros(len(cost), dtype=np.bool_)
    steps = np.array([cell, cell * math.sqrt(2.0)])  # straight, diagonal
    keys, items = np.empty(1024), np.empty(1024, dtype=np.int32)
    start = np.uint64(row * cols + col)
    cost[start], length[start] = 0.0, 0.0
    keys[0], items[0], size = 0.0, start, 1
    while size:
        at = np.uint64(items[0])
        size = _pop(keys, items, size)
        if done[at]:
            continue
        done[at] = True
        r, c = int(at) // cols, int(at) % cols
        tight = kinds[at] != OPEN
        here = price[at] * (TIGHT_COST_FACTOR if tight else 1.0)
        for dr in range(-1 if r else 0, 2 if r < rows - 1 else 1):
            for dc in range(-1 if c else 0, 2 if c < cols - 1 else 1):
                there = np.uint64(int(at) + dr * cols + dc)
                if done[there]:
                    continue
                if kinds[there] != OPEN and not (tight and kinds[there] == TIGHT):
                    continue
                weight = price[there] * (TIGHT_COST_FACTOR if kinds[there] == TIGHT else 1.0)
                step = steps[np.uint64(dr & dc & 1)]
                total = cost[at] + step * (here + weight) / 2
                if total < cost[there]:
                    cost[there], length[there] = total, length[at] + step
                    parent[there] = at
                    if size == len(keys):
                        keys, items = np.append(keys, np.empty_like(keys)), np.append(items, items)
                    size = _push(keys, items, size, total, there)
    return table


@kernel
def _push(keys, items, size, key, item):
    """Insert into a binary heap, the least key first; returns its new size."""
    k = np.uint64(size)
    while k > 0:
        above = (k - np.uint64(1)) >> np.uint64(1)
        if keys[above] <= key:
            break
        keys[k], items[k] = keys[above], items[above]
        k = above
    keys[k], items[k] = key, item
    return size + 1


@kernel
def _pop(keys, items, size):
    """Remove the first item of the heap; returns its new size."""
    size -= 1
    key, item = keys[size], items[size]
    k, last = np.uint64(0), np.uint64(size)
    while True:
        child = (k << np.uint64(1)) + np.uint64(1)
        if child >= last:
            break
        other = child + np.uint64(1)
        if other < last:
            child += np.uint64(keys[other] < keys[child])
        if keys[child] >= key:
            break
        keys[k], items[k] = keys[child], items[child]
        k = child
    keys[k], items[k] = key, item
    return size


@kernel
def trace(parent, cell):
    """Flat indices of the cells from the start to `cell`."""
    n, at = 1, cell
    while parent[at] != NO_PARENT:
        at = parent[at]
        n += 1
    path, at = np.empty(n, dtype=np.int64), cell
    for k in range(n - 1, -1, -1):
        path[k] = at
        at = parent[at]
    return path
