"""Frontiers: where known free space meets the unknown (Yamauchi 1997)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.costmap import OPEN, TIGHT, UNKNOWN, Costmap
from dynslam_env.navigation.distances import NONE
from dynslam_env.navigation.planner import Plan
from dynslam_env.navigation.regions import grouped
from slam.geometry import Array
from slam.grid import GridSpec
from slam.kernel import kernel

GATE_DISTANCE = 0.4  # m, between a frontier and a reachable cell from which it is explored
LOOK_BEYOND = 1.0  # m, from the centroid into the unknown

Point = tuple[float, float]


class Frontier(NamedTuple):
    """A cluster of free cells beside unknown ones.

    size      cells
    centroid  x, y, m
    beyond    x, y, m, LOOK_BEYOND from the centroid into the unknown: the point to look at
    cell      row, column of the reachable cell near it of least path cost; None without one
    length    m, of the path to that cell; inf without one
    distance  m, straight from the robot to its nearest cell
    """

    size: int
    centroid: Point
    beyond: Point
    cell: tuple[int, int] | None
    length: float
    distance: float


def frontiers(costmap: Costmap, plan: Plan, position: Point, min_cells: int = 5) -> list[Frontier]:
    """All frontiers of at least `min_cells` cells, for a robot at `position`, m."""
    cells, ends = grouped(frontier_cells(costmap))
    points, table = _described(cells, ends, costmap.spec, position, costmap.kinds, plan.cost)
    found, start = [], 0
    for end, row in zip(ends.tolist(), table.tolist(), strict=True):
        if end - start >= min_cells:
            found.append(_frontier(plan, points[:, start:end], row))
        start = end
    return found


def _frontier(plan: Plan, points: Array, row: list[float]) -> Frontier:
    """The frontier of cells with centres `points` (2, n), m; `row` is that of `_described`."""
    size, distance = points.shape[1], row[4]
    x, y = (np.add.reduce(points, axis=1) / size).tolist()
    centroid, beyond = (x, y), (x + LOOK_BEYOND * row[0], y + LOOK_BEYOND * row[1])
    cell = int(row[2]), int(row[3])
    if cell[0] == NONE:
        return Frontier(size, centroid, beyond, None, math.inf, distance)
    return Frontier(size, centroid, beyond, cell, float(plan.length[cell]), distance)


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
                beside = _unknown(kinds, row - 1, col) or _unknown(kinds, row + 1, col)
                found[row, col] = (
                    beside or _unknown(kinds, row, col - 1) or _unknown(kinds, row, col + 1)
                )
    return found


@kernel
def _described(cells, ends, spec: GridSpec, position, kinds, cost):
    """Of frontiers, whose cells (2, n) end at `ends` (f,): (2, n) m, the centres of the cells; and
    (f, 5) the direction x, y of the unknown, row and column of the cell from which it is explored,
    or NONE, and the distance, m."""
    points, table, k = np.empty(cells.shape), np.empty((len(ends), 5)), 0
    for f in range(len(ends)):
        right, up, nearest, gate = 0.0, 0.0, np.inf, (NONE, NONE)
        while k < ends[f]:
            row, col = cells[0, k], cells[1, k]
            x = points[0, k] = (col + spec.col0 + 0.5) * spec.resolution
            y = points[1, k] = (row + spec.row0 + 0.5) * spec.resolution
            nearest = min(nearest, np.hypot(x - position[0], y - position[1]))
            right += _unknown(kinds, row, col + 1)
            right -= _unknown(kinds, row, col - 1)
            up += _unknown(kinds, row + 1, col)
            up -= _unknown(kinds, row - 1, col)
            way = _gate(row, col, cost, spec.resolution)
            if way[0] != NONE and (gate[0] == NONE or cost[way] < cost[gate]):
                gate = way
            k += 1
        away = max(np.hypot(right, up), 1.0)
        table[f, 0], table[f, 1] = right / away, up / away
        table[f, 2], table[f, 3], table[f, 4] = gate[0], gate[1], nearest
    return points, table


@kernel
def _unknown(kinds, row, col):
    """Whether a cell is in the grid, and unknown."""
    inside = 0 <= row < kinds.shape[0] and 0 <= col < kinds.shape[1]
    return inside and kinds[row, col] == UNKNOWN


@kernel
def _gate(row, col, cost, resolution):
    """The nearest cell with a path, of two the one further left, then down; NONE if there is none
    within GATE_DISTANCE."""
    if cost[row, col] < np.inf:
        return row, col
    best, found = np.inf, (NONE, NONE)
    reach = int(np.ceil(GATE_DISTANCE / resolution))
    for c in range(max(col - reach, 0), min(col + reach + 1, cost.shape[1])):
        for r in range(max(row - reach, 0), min(row + reach + 1, cost.shape[0])):
            if cost[r, c] < np.inf:
                away = np.sqrt(((r - row) * resolution) ** 2 + ((c - col) * resolution) ** 2)
                if away <= GATE_DISTANCE and away < best:
                    best, found = away, (r, c)
    return found
