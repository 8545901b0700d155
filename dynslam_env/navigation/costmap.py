"""Costmap: where a round robot can be, and what it costs to be there.

After costmap_2d of ROS (Lu, Hershberger and Smart 2014): obstacles are inflated by the robot's
radius, and beyond it the cost falls off exponentially.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.regions import EIGHT, FOUR, distance_to, grown
from slam.geometry import Array, Pose2, transform_points
from slam.grid import GridSpec, OccupancyGrid
from slam.scan import Scan
from slam.validation import positive, within

UNKNOWN, OPEN, TIGHT, OCCUPIED = 0, 1, 2, 3
"""Kinds of cells: nothing seen; the robot's centre can be there; free, but nearer to something
occupied than the robot is wide; occupied."""

Kinds = NDArray[np.uint8]


@dataclass(frozen=True)
class Inflation:
    """How far obstacles reach.

    margin   m, kept between the body and the border of an occupied cell. Such a cell is wider than
             what stands in it already, and of a door of 0.9 m but six cells are free
    weight   what a metre costs beside an obstacle, above the 1 that it costs in the open
    falloff  m, in which that extra falls to 1/e
    swing    m, from what is known to change: so far a leaf may come, and it is no place to stop
    crossing what a metre costs there, above the other
    occupied h from which on a cell counts as occupied
    changing the same for cells that are known to change: those of a door relax towards the share
             of time that it is closed, and a door that may be open again is worth a try
    """

    margin: float = 0.02
    weight: float = 3.0
    falloff: float = 0.2
    swing: float = 0.6
    crossing: float = 2.0
    occupied: float = 0.5
    changing: float = 0.7

    def __post_init__(self) -> None:
        positive(self, "falloff")
        within(self, "margin", 0.0)
        within(self, "weight", 0.0)
        within(self, "occupied", 0.0, 1.0)
        within(self, "changing", 0.0, 1.0)


class Costmap(NamedTuple):
    """Cells of twice the SLAM map's resolution.

    kinds      (rows, cols) uint8, UNKNOWN, OPEN, TIGHT or OCCUPIED
    cost       (rows, cols) float64, of a metre there, 1 or more
    clearance  (rows, cols) float64, m, from the cell's centre to the nearest occupied cell's border
    swept      (rows, cols) bool, near what changes: a way may cross it, but none should end there
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

    Cells that the task's map knows to change are taken from there, as predicted for now. What the
    last scan hit is occupied, and where the robot's body is, is not: both are facts, whatever the
    map has not learnt yet.
    """
    spec, occupied, observed = coarse(grid, inflation.occupied)
    changing = _overlay(spec, occupied, beliefs, inflation.changing)
    rows, cols = _cells_inside(spec, transform_points(pose, scan.points))
    occupied[rows, cols] = observed[rows, cols] = True
    rows, cols = _body(spec, pose, radius)
    occupied[rows, cols], observed[rows, cols] = False, True
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
    cell = spec.resolution
    clearance = distance_to(occupied, cell) - cell / 2
    swept = distance_to(changing, cell) <= inflation.swing
    near = radius + inflation.margin
    kinds = np.where(observed, np.where(clearance < near, TIGHT, OPEN), UNKNOWN).astype(np.uint8)
    kinds[occupied] = OCCUPIED
    cost = 1.0 + inflation.weight * np.exp(-np.maximum(clearance - near, 0.0) / inflation.falloff)
    cost[swept] += inflation.crossing
    return Costmap(spec, kinds, cost, clearance, swept)


def coarse(
    grid: OccupancyGrid, threshold: float
) -> tuple[GridSpec, NDArray[np.bool_], NDArray[np.bool_]]:
    """Cells of twice the size: spec, occupied (any of the four is), observed (any of them is)."""
    spec = grid.spec
    half = GridSpec(
        2 * spec.resolution, spec.row0 // 2, spec.col0 // 2, spec.rows // 2, spec.cols // 2
    )
    occupied = grid.observed & (grid.occupied > threshold)
    return half, _any_of_four(occupied), _any_of_four(grid.observed)


def _any_of_four(fine: NDArray[np.bool_]) -> NDArray[np.bool_]:
    two = fine[::2] | fine[1::2]
    return two[:, ::2] | two[:, 1::2]


def _overlay(
    spec: GridSpec, occupied: NDArray[np.bool_], beliefs: Beliefs, threshold: float
) -> NDArray[np.bool_]:
    """Where the beliefs saw changes, and beside it, take what they predict; gives the cells that
    change."""
    there, changing = beliefs.spec, grown(_in_the_open(beliefs), EIGHT)
    rows = _counterpart(spec.row0, spec.rows, spec.resolution, there.row0, there.resolution)
    cols = _counterpart(spec.col0, spec.cols, spec.resolution, there.col0, there.resolution)
    known_rows = (rows >= 0) & (rows < there.rows)
    known_cols = (cols >= 0) & (cols < there.cols)
    at, of = np.ix_(known_rows, known_cols), np.ix_(rows[known_rows], cols[known_cols])
    predicted = beliefs.occupied[of] > threshold
    occupied[at] = np.where(changing[of], predicted, occupied[at])
    changes = np.zeros(spec.shape, dtype=np.bool_)
    changes[at] = changing[of]
    return changes


def _in_the_open(beliefs: Beliefs) -> NDArray[np.bool_]:
    """(rows, cols) cells that change and lie beside nothing solid: where a leaf hangs, its coarse
    cells would make the doorway narrower than it is."""
    changed = beliefs.flips > 0
    solid = ~beliefs.observed | (~changed & (beliefs.occupied > 0.5))
    return changed & ~grown(solid, FOUR)


def _counterpart(
    start: int, count: int, cell: float, other_start: int, other_cell: float
) -> NDArray[np.int64]:
    """(count,) rows (or columns) of another lattice that hold the centres of this one's."""
    centres = (start + np.arange(count) + 0.5) * cell
    return np.floor(centres / other_cell).astype(np.int64) - other_start


def _body(
    spec: GridSpec, pose: Pose2, radius: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The cells whose centres the robot covers."""
    reach = int(np.ceil(radius / spec.resolution))
    offsets = np.arange(-reach, reach + 1)
    centre = spec.cells(np.array([[pose.x, pose.y]]))[0]
    rows, cols = np.meshgrid(centre[0] + offsets, centre[1] + offsets, indexing="ij")
    cells = np.column_stack([rows.ravel(), cols.ravel()])
    away = np.hypot(*(spec.centres(cells) - (pose.x, pose.y)).T)
    covered = (away < radius - spec.resolution / 2) | (cells == centre).all(axis=1)
    rows, cols = cells[covered].T
    inside = _inside(spec, rows, cols)
    return rows[inside], cols[inside]


def _cells_inside(spec: GridSpec, points: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    rows, cols = spec.cells(points).T
    inside = _inside(spec, rows, cols)
    return rows[inside], cols[inside]


def _inside(spec: GridSpec, rows: NDArray[np.int64], cols: NDArray[np.int64]) -> NDArray[np.bool_]:
    return (rows >= 0) & (rows < spec.rows) & (cols >= 0) & (cols < spec.cols)
