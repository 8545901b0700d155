"""ViewpointTable: places of a floor from which doorways are seen, and the times between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.costmap import OCCUPIED, UNKNOWN, Costmap
from dynslam_env.navigation.planner import Plan, plan
from slam.geometry import Array, Pose2
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
    sees = around.copy()
    for k in np.flatnonzero(np.isfinite(lengths)):
        row, col = cells[k].tolist()
        sees[k] |= _seen_on(here.path((row, col))[::WAY_STEP], costmap, doors)
    moving = np.where(lengths > 0.3, OVERHEAD, 0.0)
    return Ways(lengths / DRIVING_SPEED + moving + LOOK_TIME, sees)


def visible(costmap: Costmap, points: Array, doors: Array) -> Bools:
    """(n, d) whether doorways (d, 4) are seen from points (n, 2), m."""
    spec = costmap.spec
    origin = np.array([spec.col0, spec.row0]) * spec.resolution
    return _visible(points.reshape(-1, 2), doors, costmap.kinds, origin, spec.resolution)


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


def _seen_on(path: Array, costmap: Costmap, doors: Array) -> Bools:
    """(d,) whether doorways are seen ahead on a path (n, 2), m."""
    if len(path) < 2:
        return np.zeros(len(doors), np.bool_)
    points, headings = path[:-1], np.arctan2(*np.diff(path, axis=0).T[::-1])
    away = doors[None, :, :2] - points[:, None]
    off = np.arctan2(away[..., 1], away[..., 0]) - headings[:, None]
    ahead = np.abs(np.remainder(off + np.pi, 2 * np.pi) - np.pi) < AHEAD
    return (visible(costmap, points, doors) & ahead).any(axis=0)


@kernel
def _visible(points, doors, kinds, origin, cell):
    found = np.zeros((len(points), len(doors)), np.bool_)
    for p in range(len(points)):
        for d in range(len(doors)):
            dx, dy = doors[d, 0] - points[p, 0], doors[d, 1] - points[p, 1]
            away = np.hypot(dx, dy)
            across = abs(dx * np.sin(doors[d, 2]) - dy * np.cos(doors[d, 2]))
            if away > MAX_SIGHT or away < 0.5 or across < MIN_INCIDENCE * away:
                continue
            steps, clear = int(np.ceil(2 * away / cell)), True
            for s in range(int(steps * (1.0 - HIDDEN / away))):
                i = int(np.floor((points[p, 1] + dy * s / steps - origin[1]) / cell))
                j = int(np.floor((points[p, 0] + dx * s / steps - origin[0]) / cell))
                clear = 0 <= i < kinds.shape[0] and 0 <= j < kinds.shape[1]
                clear = clear and kinds[i, j] != OCCUPIED and kinds[i, j] != UNKNOWN
                if not clear:
                    break
            found[p, d] = clear
    return found
