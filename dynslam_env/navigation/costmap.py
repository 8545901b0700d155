"""Costmap: the cells where a round robot fits, and the cost of a metre in each.

After costmap_2d of ROS (Lu, Hershberger and Smart 2014): obstacles are inflated by the robot's
radius, and beyond it the cost falls off exponentially.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.distances import distances
from dynslam_env.navigation.regions import (
    EIGHT_NEIGHBOURS,
    FOUR_NEIGHBOURS,
    dilated,
    disc,
    extent,
)
from slam.geometry import Array, Pose2, transform_points
from slam.grid import GridSpec, OccupancyGrid
from slam.kernel import kernel
from slam.scan import Scan
from slam.validation import positive, within

UNKNOWN, OPEN, TIGHT, OCCUPIED = 0, 1, 2, 3
"""Kinds of cells: not observed; free for the robot's centre; free, but nearer to an obstacle than
the robot's radius; occupied."""

Kinds = NDArray[np.uint8]


@dataclass(frozen=True)
class Inflation:
    """The cost of being near obstacles and doors.

    margin              m, kept between the body and the border of an occupied cell; small, as the
                        cell exceeds its obstacle, and a door of 0.9 m has only six free cells
    weight              added cost of a metre beside an obstacle; 1 is its cost in the open
    falloff             m, in which the added cost falls to 1/e
    swept_distance      m, around changing cells, that a door leaf may sweep
    swept_weight        added cost of a metre there
    occupied_threshold  P(occupied) above which a cell counts as occupied
    changing_threshold  the same for changing cells, which relax towards the share of time that
                        their door is closed; higher, as the door may be open again
    """

    margin: float = 0.02
    weight: float = 3.0
    falloff: float = 0.2
    swept_distance: float = 0.6
    swept_weight: float = 2.0
    occupied_threshold: float = 0.5
    changing_threshold: float = 0.7

    def __post_init__(self) -> None:
        positive(self, "falloff")
        within(self, "margin", 0.0)
        within(self, "weight", 0.0)
        within(self, "occupied_threshold", 0.0, 1.0)
        within(self, "changing_threshold", 0.0, 1.0)


class Costmap(NamedTuple):
    """Cells of twice the SLAM map's resolution.

    kinds      (rows, cols) uint8, UNKNOWN, OPEN, TIGHT or OCCUPIED
    cost       (rows, cols) float64, of a metre there, 1 or more
    clearance  (rows, cols) float64, m, from the cell's centre to the nearest occupied cell's
               border; inf beyond the rows and columns of all cells that were observed
    swept      (rows, cols) bool, near changing cells: a path may cross these, but not end there
    """

    spec: GridSpec
    kinds: Kinds
    cost: Array
    clearance: Array
    swept: NDArray[np.bool_]


def costmap(
    grid: OccupancyGrid,
    beliefs: Beliefs,
    scan: Scan,
    pose: Pose2,
    radius: float,
    inflation: Inflation = Inflation(),
) -> Costmap:
    """The costmap of a SLAM's map for a robot of `radius` m at the estimated `pose`.

    Changing cells are taken from the beliefs, as predicted for now. Cells hit by the last scan are
    occupied and those under the robot's body free, regardless of the map.
    """
    spec, occupied, observed = coarse(grid, inflation.occupied_threshold)
    changing = _overlay(spec, occupied, beliefs, inflation.changing_threshold)
    _mark_echoes(spec.cells(transform_points(pose, scan.points)), occupied, observed)
    _clear_body(pose.x, pose.y, radius, spec.resolution, spec.row0, spec.col0, occupied, observed)
    return inflated(spec, occupied, observed, changing, radius, inflation)


def inflated(
    spec: GridSpec,
    occupied: NDArray[np.bool_],
    observed: NDArray[np.bool_],
    changing: NDArray[np.bool_],
    radius: float,
    inflation: Inflation = Inflation(),
) -> Costmap:
    """The costmap of bool arrays (rows, cols) for a robot of `radius` m."""
    cell, (rows, cols) = spec.resolution, extent(occupied | observed)
    near = radius + inflation.margin
    room = distances(occupied[rows, cols], cell) - cell / 2
    falling = np.exp(-np.maximum(room - near, 0.0) / inflation.falloff)
    swept = dilated(changing, disc(cell, inflation.swept_distance))
    weights = inflation.weight, inflation.swept_weight
    clearance, cost = _laid_out(room, falling, swept, (rows.start, cols.start), weights)
    return Costmap(spec, kinds_of(occupied, observed, clearance < near), cost, clearance, swept)


@kernel
def _laid_out(room, falling, swept, corner, weights):
    """(rows, cols) clearance, and cost of a metre: `room` and `falling` (the cost of being near
    obstacles falls to this share) are those of a part of the cells, from a corner on."""
    clearance, cost = np.full(swept.shape, np.inf), np.ones(swept.shape)
    for i in range(len(room)):
        for j in range(room.shape[1]):
            row, col = corner[0] + i, corner[1] + j
            clearance[row, col] = room[i, j]
            cost[row, col] += weights[0] * falling[i, j]
    for row in range(len(swept)):
        for col in range(swept.shape[1]):
            if swept[row, col]:
                cost[row, col] += weights[1]
    return clearance, cost


@kernel
def kinds_of(occupied, observed, tight):
    """(rows, cols) uint8 kinds of cells, `tight` being those too near to an occupied one."""
    rows, cols = occupied.shape
    kinds = np.full((rows, cols), UNKNOWN, np.uint8)
    for row in range(rows):
        for col in range(cols):
            if occupied[row, col]:
                kinds[row, col] = OCCUPIED
            elif observed[row, col]:
                kinds[row, col] = TIGHT if tight[row, col] else OPEN
    return kinds


def nearer_than(occupied: NDArray[np.bool_], cell: float, distance: float) -> NDArray[np.bool_]:
    """(rows, cols) whether the clearance, as in `inflated`, is less than `distance`, m.

    Where few cells are occupied, it takes a fraction of the time that all clearances take."""
    return dilated(occupied, disc(cell, math.nextafter(distance, -math.inf), cell / 2))


def coarse(
    grid: OccupancyGrid, threshold: float
) -> tuple[GridSpec, NDArray[np.bool_], NDArray[np.bool_]]:
    """Spec, occupied and observed of cells of twice the size: true where any of their four is."""
    spec = grid.spec
    half = GridSpec(
        2 * spec.resolution, spec.row0 // 2, spec.col0 // 2, spec.rows // 2, spec.cols // 2
    )
    return half, *_any_of_four(grid.occupied, grid.observed, grid.occupied.dtype.type(threshold))


@kernel
def _any_of_four(h, seen, threshold):
    """(rows, cols) whether one of four cells was observed and has an h above the threshold, and
    whether one was observed."""
    shape = h.shape[0] // 2, h.shape[1] // 2
    occupied, observed = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
    for row in range(shape[0]):
        low, high = seen[2 * row], seen[2 * row + 1]
        for col in range(shape[1]):
            left, right = 2 * col, 2 * col + 1
            if low[left] | low[right] | high[left] | high[right]:
                observed[row, col] = True
                occupied[row, col] = (
                    (low[left] and h[2 * row, left] > threshold)
                    or (low[right] and h[2 * row, right] > threshold)
                    or (high[left] and h[2 * row + 1, left] > threshold)
                    or (high[right] and h[2 * row + 1, right] > threshold)
                )
    return occupied, observed


def _overlay(
    spec: GridSpec, occupied: NDArray[np.bool_], beliefs: Beliefs, threshold: float
) -> NDArray[np.bool_]:
    """Write the beliefs' prediction into changing cells of `occupied` and their neighbours.

    Returns these cells (rows, cols)."""
    changes = np.zeros(spec.shape, dtype=np.bool_)
    in_the_open = _in_the_open(beliefs)
    if not in_the_open.any():
        return changes
    there, changing = beliefs.spec, dilated(in_the_open, EIGHT_NEIGHBOURS)
    rows = _counterpart(spec.row0, spec.rows, spec.resolution, there.row0, there.resolution)
    cols = _counterpart(spec.col0, spec.cols, spec.resolution, there.col0, there.resolution)
    _predict(rows, cols, changing, beliefs.occupied > threshold, occupied, changes)
    return changes


@kernel
def _predict(rows, cols, changing, predicted, occupied, changes):
    """Mark the cells whose counterparts change in `changes`, and write the prediction there."""
    for i in range(len(rows)):
        for j in range(len(cols)):
            row, col = rows[i], cols[j]
            known = 0 <= row < changing.shape[0] and 0 <= col < changing.shape[1]
            if known and changing[row, col]:
                occupied[i, j], changes[i, j] = predicted[row, col], True


def _in_the_open(beliefs: Beliefs) -> NDArray[np.bool_]:
    """(rows, cols) changing cells that are not beside a wall: those at a hinge would make the
    doorway narrower than it is."""
    changed = beliefs.flips > 0
    if not changed.any():
        return changed
    solid = ~beliefs.observed | (~changed & (beliefs.occupied > 0.5))
    return changed & ~dilated(solid, FOUR_NEIGHBOURS)


def _counterpart(
    start: int, count: int, cell: float, other_start: int, other_cell: float
) -> NDArray[np.int64]:
    """(count,) rows (or columns) of another lattice that hold the centres of this one's."""
    centres = (start + np.arange(count) + 0.5) * cell
    return np.floor(centres / other_cell).astype(np.int64) - other_start


@kernel
def _clear_body(x, y, radius, cell, row0, col0, occupied, observed):
    """Make the cells whose centres a robot at `x`, `y` covers, and its own, free; m. `row0` and
    `col0` are those of the grid."""
    row, col = int(np.floor(y / cell)), int(np.floor(x / cell))
    reach = int(np.ceil(radius / cell))
    for r in range(row - reach, row + reach + 1):
        for c in range(col - reach, col + reach + 1):
            away = np.hypot((c + 0.5) * cell - x, (r + 0.5) * cell - y)
            i, j = r - row0, c - col0
            inside = 0 <= i < occupied.shape[0] and 0 <= j < occupied.shape[1]
            if inside and (away < radius - cell / 2 or (r == row and c == col)):
                occupied[i, j], observed[i, j] = False, True


@kernel
def _mark_echoes(cells, occupied, observed):
    """Set (rows, cols) `occupied` and `observed` of `cells` (n, 2), if they lie in the grid."""
    for k in range(len(cells)):
        row, col = cells[k]
        if 0 <= row < occupied.shape[0] and 0 <= col < occupied.shape[1]:
            occupied[row, col] = observed[row, col] = True
