"""Sight: cells of a costmap from which a point can be seen."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.costmap import OCCUPIED, UNKNOWN, Costmap
from dynslam_env.navigation.planner import Plan
from slam.geometry import Array
from slam.kernel import kernel

MIN_VIEW_DISTANCE, MAX_VIEW_DISTANCE = 0.7, 3.0  # m, from a viewpoint to its target


def viewpoint(
    costmap: Costmap,
    plan: Plan,
    target: Array,
    hidden_radius: float,
    min_distance: float = MIN_VIEW_DISTANCE,
    max_distance: float = MAX_VIEW_DISTANCE,
) -> tuple[int, int] | None:
    """Row and column of the cell of least path cost that sees `target` (2,), m; None without one.

    Cells that a leaf may sweep are left out.

    hidden_radius  m around the target in which nothing counts as hiding it, as a door's own leaf
    min_distance   m, from the target
    max_distance   m
    """
    spec = costmap.spec
    row, col = spec.cells(target[None])[0]
    reach = math.ceil(max_distance / spec.resolution)
    top, bottom = max(row - reach, 0), min(row + reach + 1, spec.rows)
    left, right = max(col - reach, 0), min(col + reach + 1, spec.cols)
    if top >= bottom or left >= right:
        return None
    cost = plan.cost[top:bottom, left:right]
    fit = np.isfinite(cost) & ~costmap.swept[top:bottom, left:right]
    cells = np.argwhere(fit) + (top, left)
    away = np.hypot(*(spec.centres(cells) - target).T)
    cells = cells[(away >= min_distance) & (away <= max_distance)]
    order = np.argsort(plan.cost[tuple(cells.T)], kind="stable")
    best = _first_in_sight(cells[order], row, col, hidden_radius / spec.resolution, costmap.kinds)
    if best < 0:
        return None
    found_row, found_col = cells[order[best]].tolist()
    return found_row, found_col


def in_sight(costmap: Costmap, cell: tuple[int, int], target: Array, hidden_radius: float) -> bool:
    """Whether `cell` sees `target` (2,), m; see `viewpoint`."""
    row, col = costmap.spec.cells(target[None])[0]
    cells: NDArray[np.int64] = np.array([cell])
    radius = hidden_radius / costmap.spec.resolution
    return _first_in_sight(cells, row, col, radius, costmap.kinds) == 0


@kernel
def _first_in_sight(cells, row, col, hidden_radius, kinds):
    """Index of the first of `cells` (n, 2) that sees (row, col), or -1; radius in cells."""
    for k in range(len(cells)):
        dr, dc = cells[k, 0] - row, cells[k, 1] - col
        away = math.sqrt(float(dr * dr + dc * dc))
        steps = int(np.ceil(2 * away)) + 1
        clear = True
        for s in range(steps):
            share = s / steps
            if share * away < hidden_radius:
                continue
            i, j = int(np.rint(row + share * dr)), int(np.rint(col + share * dc))
            if not (0 <= i < kinds.shape[0] and 0 <= j < kinds.shape[1]):
                clear = False
                break
            if kinds[i, j] == OCCUPIED or kinds[i, j] == UNKNOWN:
                clear = False
                break
        if clear:
            return k
    return -1
