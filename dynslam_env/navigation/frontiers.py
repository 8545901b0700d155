"""Frontiers: where known free space meets the unknown (Yamauchi 1997)."""

from __future__ import annotations

import math
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
    gates, ends = (
        _Gates.of(plan, costmap.spec.resolution),
        np.cumsum([len(here) for here in groups]),
    )
    columns = np.concatenate([here.T for here in groups], axis=1)
    points = costmap.spec.centres(columns.T)
    away = np.hypot(*(points - position).T)
    found = []
    for here, end in zip(groups, ends.tolist(), strict=True):
        size, (cell, length) = len(here), gates.best(here)
        centroid = points[end - size : end].sum(axis=0) / size
        beyond = centroid + LOOK_BEYOND * _outward(here, costmap)
        distance = float(away[end - size : end].min())
        found.append(Frontier(size, centroid, beyond, cell, length, distance))
    return found


class _Gates(NamedTuple):
    """The reachable cells of a plan that are nearest to the cells around them.

    plan    the plan
    corner  row and column at which the arrays begin
    away    (rows, cols) m, to the nearest reachable cell
    cell    (2, rows, cols) its row and column, from the corner
    """

    plan: Plan
    corner: tuple[int, int]
    away: Array
    cell: NDArray[np.int32]

    @staticmethod
    def of(plan: Plan, resolution: float) -> _Gates:
        """Those of the cells within GATE_DISTANCE, and of some beyond."""
        rows, cols = extent(plan.reached, math.ceil(GATE_DISTANCE / resolution))
        away, cell = nearest(plan.reached[rows, cols], resolution)
        return _Gates(plan, (rows.start, cols.start), away, cell)

    def best(self, cells: NDArray[np.int64]) -> tuple[tuple[int, int] | None, float]:
        """Row and column of the reachable cell of least path cost near a frontier's cells (n, 2);
        the path's length."""
        row, col = _best(cells, self.corner, self.away, self.cell, self.plan.cost)
        if row == NONE:
            return None, math.inf
        return (row, col), float(self.plan.length[row, col])


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


def _outward(cells: NDArray[np.int64], costmap: Costmap) -> Array:
    """(2,) unit vector from a frontier's cells (n, 2) to the unknown cells beside them; zero where
    these lie on all sides."""
    x, y = _towards_unknown(cells, costmap.kinds)
    return np.array([x, y]) / max(float(np.hypot(x, y)), 1.0)


@kernel
def _towards_unknown(cells, kinds):
    """Columns and rows, sum of the steps from `cells` to unknown ones among their neighbours."""
    (rows, cols), x, y = kinds.shape, 0.0, 0.0
    for k in range(len(cells)):
        row, col = cells[k]
        x += col + 1 < cols and kinds[row, col + 1] == UNKNOWN
        x -= col > 0 and kinds[row, col - 1] == UNKNOWN
        y += row + 1 < rows and kinds[row + 1, col] == UNKNOWN
        y -= row > 0 and kinds[row - 1, col] == UNKNOWN
    return x, y


@kernel
def _best(cells, corner, away, gates, cost):
    """Row and column of the gate of least cost, the first of several; NONE without one."""
    best, found = np.inf, (NONE, NONE)
    for k in range(len(cells)):
        row, col = cells[k, 0] - corner[0], cells[k, 1] - corner[1]
        inside = 0 <= row < away.shape[0] and 0 <= col < away.shape[1]
        if inside and away[row, col] <= GATE_DISTANCE:
            gate = int(corner[0] + gates[0, row, col]), int(corner[1] + gates[1, row, col])
            if cost[gate] < best or found[0] == NONE:
                best, found = cost[gate], gate
    return found
