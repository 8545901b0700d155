"""ViewpointTable: places of a floor from which doorways are seen, and the times between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.costmap import OCCUPIED, UNKNOWN, Costmap
from dynslam_env.navigation.planner import Plan, plan, trace
from slam.geometry import Array, Pose2
from slam.grid import GridSpec
from slam.kernel import kernel

MAX_VIEWPOINTS = 24
MIN_CLEARANCE = 0.35  # m, of a viewpoint
STRIDE = 3  # cells between two places that are compared
APART = 2.5  # m, between viewpoints that show the same doorways
MAX_SIGHT = 6.5  # m, to a doorway
MIN_INCIDENCE = 0.5  # sine of the angle between sight and wall: flatter, jambs hide the leaf
HIDDEN = 0.35  # m before a doorway's middle, where its own leaf and jambs do not count as hiding it
WAY_STEP = 8  # cells of a path between two looks on the way
AHEAD = 1.4  # rad, on each side of the direction of driving, that the laser sees
DRIVING_SPEED = 0.45  # m/s, mean along a path
OVERHEAD = 1.5  # s, for starting and stopping
LOOK_TIME = 3.0  # s, for the turn at a viewpoint, after which all around was in the laser's view

Bools = NDArray[np.bool_]


class Ways(NamedTuple):
    """The ways from one place to all viewpoints.

    times  (v,) s to drive there and look around; inf where no path leads
    sees   (v, d) whether a doorway is seen on the way or there
    """

    times: Array
    sees: Bools


class ViewpointTable(NamedTuple):
    """v viewpoints for d doorways.

    points   (v, 2) m
    doors    (d, 4) the doorways: x, y of the middle, m; direction of the wall, rad; width, m
    around   (v, d) whether a doorway is seen from a viewpoint
    between  (v, v) s from a viewpoint to another, with the look around there
    then     (v, v, d) whether a doorway is seen on that way or there
    """

    points: Array
    doors: Array
    around: Bools
    between: Array
    then: Bools


def viewpoint_table(costmap: Costmap, reached: Plan, doors: Array) -> ViewpointTable:
    """The table of a floor; `reached` is the plan from where the robot is, doors are (d, 4)."""
    points = viewpoints(costmap, reached, doors)
    return table_of(costmap, points, doors, plans_from(costmap, points))


def plans_from(costmap: Costmap, points: Array) -> list[Plan]:
    """The plan from each of some points (v, 2), m."""
    return [plan(costmap, Pose2(x, y, 0.0)) for x, y in points.tolist()]


def table_of(
    costmap: Costmap, points: Array, doors: Array, plans: Sequence[Plan]
) -> ViewpointTable:
    """The table of viewpoints `points` (v, 2), m, from the `plans` from each of them."""
    around = visible(costmap, points, doors)
    ways = [ways_from(costmap, here, points, doors, around) for here in plans]
    between = np.array([way.times for way in ways]).reshape(len(points), len(points))
    then = np.array([way.sees for way in ways], dtype=np.bool_)
    return ViewpointTable(points, doors, around, between, then.reshape(*between.shape, len(doors)))


def ways_from(costmap: Costmap, here: Plan, points: Array, doors: Array, around: Bools) -> Ways:
    """The ways to all `points` (v, 2), m, of the table, from the start of the plan `here`."""
    cells = costmap.spec.cells(points)
    inside = ((cells >= 0) & (cells < costmap.spec.shape)).all(axis=1)
    lengths = np.full(len(points), np.inf)
    lengths[inside] = here.length[tuple(cells[inside].T)]
    sees, ends = around.copy(), np.flatnonzero(np.isfinite(lengths))
    _see_on_ways(here.parent, cells[ends], doors, costmap.kinds, costmap.spec, ends, sees)
    moving = np.where(lengths > 0.3, OVERHEAD, 0.0)
    return Ways(lengths / DRIVING_SPEED + moving + LOOK_TIME, sees)


def visible(costmap: Costmap, points: Array, doors: Array) -> Bools:
    """(n, d) whether doorways (d, 4) are seen from points (n, 2), m."""
    return _visible(points.reshape(-1, 2), doors, costmap.kinds, costmap.spec)


def viewpoints(costmap: Costmap, reached: Plan, doors: Array) -> Array:
    """(v, 2) m: of places that show most, those that show other doorways or are far apart."""
    fit = reached.reached & ~costmap.swept & (costmap.clearance > MIN_CLEARANCE)
    rows, cols = np.indices(fit.shape)
    cells = np.argwhere(fit & (rows % STRIDE == 0) & (cols % STRIDE == 0))
    points = costmap.spec.centres(cells)
    shown = visible(costmap, points, doors)
    counts, clearance = shown.sum(axis=1), costmap.clearance[tuple(cells.T)]
    kept: list[int] = []
    for k in np.lexsort((-clearance, -counts)):
        near = [i for i in kept if np.hypot(*(points[i] - points[k])) < APART]
        if counts[k] and not any((shown[k] <= shown[i]).all() for i in near):
            kept.append(int(k))
        if len(kept) == MAX_VIEWPOINTS:
            break
    return points[kept]


@kernel
def _see_on_ways(parent, cells, doors, kinds, spec: GridSpec, rows, sees):
    """Mark in `rows` (n,) of `sees` (v, d) the doorways seen ahead on the paths to `cells` (n, 2),
    looking at each WAY_STEP-th cell."""
    for k in range(len(cells)):
        path = trace(parent.ravel(), cells[k, 0] * spec.cols + cells[k, 1])[::WAY_STEP]
        for i in range(len(path) - 1):
            x, y = _centre(path[i], spec)
            after = _centre(path[i + 1], spec)
            heading = np.arctan2(after[1] - y, after[0] - x)
            for d in range(len(doors)):
                if sees[rows[k], d]:
                    continue
                off = np.arctan2(doors[d, 1] - y, doors[d, 0] - x) - heading
                ahead = np.abs((off + np.pi) % (2 * np.pi) - np.pi) < AHEAD
                sees[rows[k], d] = ahead and _shows(x, y, doors[d], kinds, spec)


@kernel
def _centre(cell, spec: GridSpec):
    """x, y of the centre of a cell, m, by its flat index."""
    row, col = cell // spec.cols, cell % spec.cols
    return (spec.col0 + col + 0.5) * spec.resolution, (spec.row0 + row + 0.5) * spec.resolution


@kernel
def _visible(points, doors, kinds, spec: GridSpec):
    found = np.zeros((len(points), len(doors)), np.bool_)
    for p in range(len(points)):
        for d in range(len(doors)):
            found[p, d] = _shows(points[p, 0], points[p, 1], doors[d], kinds, spec)
    return found


@kernel
def _shows(x, y, door, kinds, spec: GridSpec):
    """Whether a doorway is seen from a point, m."""
    cell, left, below = spec.resolution, spec.col0 * spec.resolution, spec.row0 * spec.resolution
    dx, dy = door[0] - x, door[1] - y
    away = np.hypot(dx, dy)
    across = abs(dx * np.sin(door[2]) - dy * np.cos(door[2]))
    if away > MAX_SIGHT or away < 0.5 or across < MIN_INCIDENCE * away:
        return False
    steps = int(np.ceil(2 * away / cell))
    for s in range(int(steps * (1.0 - HIDDEN / away))):
        i = int(np.floor((y + dy * s / steps - below) / cell))
        j = int(np.floor((x + dx * s / steps - left) / cell))
        if not (0 <= i < kinds.shape[0] and 0 <= j < kinds.shape[1]):
            return False
        if kinds[i, j] == OCCUPIED or kinds[i, j] == UNKNOWN:
            return False
    return True
