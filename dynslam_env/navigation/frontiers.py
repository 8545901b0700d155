"""Frontiers: where known free space meets the unknown (Yamauchi 1997)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.costmap import OPEN, TIGHT, UNKNOWN, Costmap
from dynslam_env.navigation.planner import Plan
from dynslam_env.navigation.regions import clusters, nearest_of
from slam.geometry import Array

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
    near, to = nearest_of(plan.reached, costmap.spec.resolution)
    found = []
    for here in clusters(frontier_cells(costmap), min_cells):
        points = costmap.spec.centres(here)
        away = np.hypot(*(points - position).T)
        cell, length = _gate(here, plan, near, to)
        size, centroid = len(here), points.mean(axis=0)
        beyond = centroid + LOOK_BEYOND * _outward(here, costmap)
        found.append(Frontier(size, centroid, beyond, cell, length, float(away.min())))
    return found


def frontier_cells(costmap: Costmap) -> NDArray[np.bool_]:
    """(rows, cols) free cells with an unknown one among their four neighbours."""
    unknown = costmap.kinds == UNKNOWN
    free = (costmap.kinds == OPEN) | (costmap.kinds == TIGHT)
    beside = np.zeros_like(unknown)
    beside[1:] |= unknown[:-1]
    beside[:-1] |= unknown[1:]
    beside[:, 1:] |= unknown[:, :-1]
    beside[:, :-1] |= unknown[:, 1:]
    return free & beside


def _outward(cells: NDArray[np.int64], costmap: Costmap) -> Array:
    """(2,) unit vector from a frontier's cells (n, 2) to the unknown cells beside them; zero where
    these lie on all sides."""
    unknown = np.pad(costmap.kinds == UNKNOWN, 1)
    total = np.zeros(2)
    for row, col in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        total += unknown[tuple((cells + (1 + row, 1 + col)).T)].sum() * np.array([col, row])
    return total / max(float(np.hypot(*total)), 1.0)


def _gate(
    cells: NDArray[np.int64], plan: Plan, near: Array, to: NDArray[np.int32]
) -> tuple[tuple[int, int] | None, float]:
    """The reachable cell of least path cost near a frontier's cells (n, 2); the path's length."""
    rows, cols = cells[near[tuple(cells.T)] <= GATE_DISTANCE].T
    if not len(rows):
        return None, np.inf
    gate_rows, gate_cols = to[0, rows, cols], to[1, rows, cols]
    best = int(np.argmin(plan.cost[gate_rows, gate_cols]))
    row, col = int(gate_rows[best]), int(gate_cols[best])
    return (row, col), float(plan.length[row, col])
