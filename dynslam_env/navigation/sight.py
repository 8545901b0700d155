"""Sight: from where a point can be seen in a costmap."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.costmap import OCCUPIED, UNKNOWN, Costmap
from dynslam_env.navigation.planner import Plan
from slam.geometry import Array
from slam.kernel import kernel

NEAREST, FARTHEST = 0.7, 3.0  # m, from which a door is looked at


def viewpoint(
    costmap: Costmap,
    plan: Plan,
    target: Array,
    around: float,
    nearest: float = NEAREST,
    farthest: float = FARTHEST,
) -> tuple[int, int] | None:
    """Row and column of the cell that is reached at the least cost and sees `target` (2,), m.

    It is none where a leaf may sweep. None if there is none.

    around    m: within it of the target nothing hides it, as a door's own leaf does
    nearest   m, from the target
    farthest  m
    """
    spec = costmap.spec
    row, col = spec.cells(target[None])[0]
    reach = math.ceil(farthest / spec.resolution)
    top, bottom = max(row - reach, 0), min(row + reach + 1, spec.rows)
    left, right = max(col - reach, 0), min(col + reach + 1, spec.cols)
    if top >= bottom or left >= right:
        return None
    cost = plan.cost[top:bottom, left:right]
    fit = np.isfinite(cost) & ~costmap.swept[top:bottom, left:right]
    cells = np.argwhere(fit) + (top, left)
    away = np.hypot(*(spec.centres(cells) - target).T)
    cells = cells[(away >= nearest) & (away <= farthest)]
    order = np.argsort(plan.cost[tuple(cells.T)], kind="stable")
    best = _first_in_sight(cells[order], row, col, around / spec.resolution, costmap.kinds)
    if best < 0:
        return None
    found_row, found_col = cells[order[best]].tolist()
    return found_row, found_col


def in_sight(costmap: Costmap, cell: tuple[int, int], target: Array, around: float) -> bool:
    """Whether `cell` sees `target` (2,), m; see `viewpoint`."""
    row, col = costmap.spec.cells(target[None])[0]
    cells: NDArray[np.int64] = np.array([cell])
    return _first_in_sight(cells, row, col, around / costmap.spec.resolution, costmap.kinds) == 0


@kernel
def _first_in_sight(cells, row, col, around, kinds):
    """The first of `cells` (n, 2) from which (row, col) is seen, -1 if there is none; cells."""
    for k in range(len(cells)):
        dr, dc = cells[k, 0] - row, cells[k, 1] - col
        away = math.sqrt(float(dr * dr + dc * dc))
        steps = int(np.ceil(2 * away)) + 1
        clear = True
        for s in range(steps):
            share = s / steps
            if share * away < around:
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
