"""Frontiers: where known free space meets the unknown (Yamauchi 1997)."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.costmap import OPEN, TIGHT, UNKNOWN, Costmap
from dynslam_env.navigation.nearest import NONE, nearest
from dynslam_env.navigation.planner import Plan
from dynslam_env.navigation.regions import clusters, extent
from slam.geometry import Array
from slam.kernel import kernel

GATE_DISTANCE = 0.4  # m, between a frontier and a reachable cell from which it is explored
LOOK_BEYOND = 1.0  # m, from the centroid into the unknown


class Frontier(NamedTuple):
    """A cluster of free cells beside unknown ones.

    size      cells
    centroid  (2,) m
    beyond    (2,) m, LOOK_BEYOND from the centroid into the unknown: the point to look at
    cell      row, column of the reachable cell near it of least path cost; None without one
    length    m, of the path to that cell; inf without one
    distance  m, straight from the robot to its nearest cell
    """

    size: int
    centroid: Array
    beyond: Array
    cell: tuple[int, int] | None
    length: float
    distance: float


def frontiers(
    costmap: Costmap, plan: Plan, position: tuple[float, float], min_cells: int = 5
) -> list[Frontier]:
    """All frontiers of at least `min_cells` cells, for a robot at `position`, m."""
    groups = clusters(frontier_cells(costmap), min_cells)
    if not groups:
        return []
    cells = np.concatenate([here.T for here in groups], axis=1)
    sizes = np.array([len(here) for here in groups])
    ends = sizes.cumsum()
    points = costmap.spec.centres(cells.T)
    away = np.hypot(*(points - position).T)
    gates = _gates(cells, ends, plan, costmap.spec.resolution)
    sides = pairwise([0, *ends.tolist()])
    sums = [np.add.reduce(points[start:end], axis=0) for start, end in sides]
    centroids = np.array(sums) / sizes[:, None]
    beyond = centroids + LOOK_BEYOND * _outward(cells, ends, costmap)
    nearest_cells = np.minimum.reduceat(away, [0, *ends[:-1]])
    found = zip(groups, centroids, beyond, gates.tolist(), nearest_cells.tolist(), strict=True)
    return [_frontier(plan, len(here), *others) for here, *others in found]


def _frontier(
    plan: Plan, size: int, centroid: Array, beyond: Array, gate: list[int], distance: float
) -> Frontier:
    """A frontier, with the path to its `gate`: row and column, or NONE."""
    row, col = gate
    if row == NONE:
        return Frontier(size, centroid, beyond, None, math.inf, distance)
    length = float(plan.length[row, col])
    return Frontier(size, centroid, beyond, (row, col), length, distance)


def frontier_cells(costmap: Costmap) -> NDArray[np.bool_]:
    """(rows, cols) free cells with an unknown one among their four neighbours."""
    return _beside_unknown(costmap.kinds)


@kernel
def _beside_unknown(kinds):
    rows, cols = kinds.shape
    found = np.zeros((rows, cols), np.bool_)
    for row in range(rows):
        for col in range(cols):
            if kinds[row, col] == OPEN or kinds[row, col] == TIGHT:
                found[row, col] = (
                    (row > 0 and kinds[row - 1, col] == UNKNOWN)
                    or (row + 1 < rows and kinds[row + 1, col] == UNKNOWN)
                    or (col > 0 and kinds[row, col - 1] == UNKNOWN)
                    or (col + 1 < cols and kinds[row, col + 1] == UNKNOWN)
                )
    return found


def _outward(cells: NDArray[np.int64], ends: NDArray[np.int64], costmap: Costmap) -> Array:
    """(f, 2) unit vectors from the cells (2, n) of frontiers, which end at `ends` (f,), to the
    unknown ones beside them; zero where these lie on all sides."""
    towards = _towards_unknown(cells, ends, costmap.kinds)
    return towards / np.maximum(np.hypot(*towards.T), 1.0)[:, None]


@kernel
def _towards_unknown(cells, ends, kinds):
    """(f, 2) columns and rows: sums of the steps from cells to unknown ones among neighbours."""
    rows, cols = kinds.shape
    found, k = np.zeros((len(ends), 2)), 0
    for f in range(len(ends)):
        while k < ends[f]:
            row, col = cells[0, k], cells[1, k]
            found[f, 0] += col + 1 < cols and kinds[row, col + 1] == UNKNOWN
            found[f, 0] -= col > 0 and kinds[row, col - 1] == UNKNOWN
            found[f, 1] += row + 1 < rows and kinds[row + 1, col] == UNKNOWN
            found[f, 1] -= row > 0 and kinds[row - 1, col] == UNKNOWN
            k += 1
    return found


def _gates(
    cells: NDArray[np.int64], ends: NDArray[np.int64], plan: Plan, resolution: float
) -> NDArray[np.int64]:
    """(f, 2) row and column of the reachable cell of least path cost near the cells (2, n) of each
    frontier; NONE without one."""
    reached = plan.reached
    rows, cols = extent(reached, math.ceil(GATE_DISTANCE / resolution))
    away, nearby = nearest(reached[rows, cols], resolution)
    return _cheapest(cells, ends, (rows.start, cols.start), away, nearby, plan.cost)


@kernel
def _cheapest(cells, ends, corner, away, nearby, cost):
    """The first cell of least cost of each frontier, of those `nearby`, which are counted from
    `corner`."""
    found, k = np.full((len(ends), 2), NONE, np.int64), 0
    for f in range(len(ends)):
        best = np.inf
        while k < ends[f]:
            row, col = cells[0, k] - corner[0], cells[1, k] - corner[1]
            k += 1
            inside = 0 <= row < away.shape[0] and 0 <= col < away.shape[1]
            if inside and away[row, col] <= GATE_DISTANCE:
                gate = corner[0] + nearby[0, row, col], corner[1] + nearby[1, row, col]
                if cost[gate] < best:
                    best, found[f, 0], found[f, 1] = cost[gate], gate[0], gate[1]
    return found
