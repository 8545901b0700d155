"""Grids on one global lattice of square cells, which grow without resampling."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2, transform_points

TILE = 64  # a grid's borders lie on multiples of this many cells
OCCUPIED = 0.5  # h above which an observed cell counts as occupied
MOST_CELLS = 40_000_000  # of a grid: 316 m x 316 m at 5 cm, about 2.4 GB of map and field


class GridSpec(NamedTuple):
    """The range of lattice cells that a grid covers.

    Cell (row, col) of the grid is the square with its lower left corner at
    ((col0 + col) * resolution, (row0 + row) * resolution) in the world: x grows with the column,
    y with the row.
    """

    resolution: float
    row0: int
    col0: int
    rows: int
    cols: int

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, cols)."""
        return self.rows, self.cols

    @property
    def origin(self) -> tuple[float, float]:
        """World x, y of the lower left corner, m."""
        return self.col0 * self.resolution, self.row0 * self.resolution

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """World left, right, bottom, top in m (matplotlib's `extent` with origin="lower")."""
        x, y = self.origin
        return x, x + self.cols * self.resolution, y, y + self.rows * self.resolution

    def cells(self, points: Array) -> np.ndarray:
        """(n, 2) int rows and columns of the cells that hold points (n, 2), m, in the grid or
        outside."""
        lattice = np.floor(np.asarray(points)[:, ::-1] / self.resolution).astype(np.int64)
        return lattice - (self.row0, self.col0)

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell that holds a point, m, in the grid or outside."""
        return (
            math.floor(y / self.resolution) - self.row0,
            math.floor(x / self.resolution) - self.col0,
        )

    def centres(self, cells: np.ndarray) -> Array:
        """(n, 2) world x, y in m of the centres of cells (n, 2) given as rows and columns."""
        lattice = np.asarray(cells) + (self.row0, self.col0)
        return (lattice[:, ::-1] + 0.5) * self.resolution

    def covering(self, low: tuple[float, float], high: tuple[float, float]) -> GridSpec:
        """This grid, or a larger one that also holds the world box from `low` to `high`, m."""
        if not (self.rows and self.cols):
            return GridSpec.around(low, high, self.resolution)
        row0, row1 = _reach(low[1], high[1], self.resolution, self.row0, self.row0 + self.rows)
        col0, col1 = _reach(low[0], high[0], self.resolution, self.col0, self.col0 + self.cols)
        if (row1 - row0) * (col1 - col0) > MOST_CELLS:
            raise InputError(
                f"a map from ({low[0]:.0f}, {low[1]:.0f}) to ({high[0]:.0f}, {high[1]:.0f}) m in "
                f"cells of {self.resolution} m has more than {MOST_CELLS} cells: does the "
                f"odometry leap?"
            )
        return GridSpec(self.resolution, row0, col0, row1 - row0, col1 - col0)

    @staticmethod
    def around(low: tuple[float, float], high: tuple[float, float], resolution: float) -> GridSpec:
        """The smallest grid of whole tiles that holds the world box from `low` to `high`, m."""
        tile = resolution * TILE
        row0, col0 = math.floor(low[1] / tile) * TILE, math.floor(low[0] / tile) * TILE
        return GridSpec(resolution, row0, col0, TILE, TILE).covering(low, high)


def _reach(low: float, high: float, resolution: float, start: int, stop: int) -> tuple[int, int]:
    tile = resolution * TILE
    return (
        min(start, math.floor(low / tile) * TILE),
        max(stop, (math.floor(high / tile) + 1) * TILE),
    )


def grown(array: np.ndarray, old: GridSpec, new: GridSpec, fill: float) -> np.ndarray:
    """`array` of grid `old` as an array of the larger grid `new`, the new cells set to `fill`."""
    result = np.full(new.shape + array.shape[2:], fill, dtype=array.dtype)
    row, col = old.row0 - new.row0, old.col0 - new.col0
    result[row : row + old.rows, col : col + old.cols] = array
    return result


@dataclass(frozen=True)
class OccupancyGrid:
    """The map that a SLAM returns.

    occupied  (rows, cols) h, P(occupied now); the prior in unobserved cells
    observed  (rows, cols) bool, True in cells that were observed
    """

    spec: GridSpec
    occupied: np.ndarray
    observed: np.ndarray

    @property
    def solid(self) -> np.ndarray:
        """(rows, cols) bool, True in observed cells with h above OCCUPIED."""
        return self.observed & (self.occupied > OCCUPIED)

    def sample(self, points: Array) -> tuple[Array, np.ndarray]:
        """(n,) h of the cells that hold points (n, 2), m, and whether they were observed; False
        outside of the grid, where h is 0."""
        cells = self.spec.cells(points)
        inside = ((cells >= 0) & (cells < self.spec.shape)).all(axis=1)
        rows, cols = cells[inside].T
        occupied, observed = np.zeros(len(cells)), np.zeros(len(cells), np.bool_)
        occupied[inside], observed[inside] = self.occupied[rows, cols], self.observed[rows, cols]
        return occupied, observed


def moved(grid: OccupancyGrid, frame: Pose2) -> OccupancyGrid:
    """A map whose frame has the pose `frame` in the world, resampled on the world's lattice by
    nearest neighbour: each cell takes the value of the map's cell that holds its centre."""
    if frame == Pose2():
        return grid
    left, right, bottom, top = grid.spec.extent
    corners = np.array([(left, bottom), (left, top), (right, bottom), (right, top)])
    ends = transform_points(frame, corners)
    low, high = ends.min(axis=0).tolist(), ends.max(axis=0).tolist()
    spec = GridSpec.around((low[0], low[1]), (high[0], high[1]), grid.spec.resolution)
    cells = np.indices(spec.shape).reshape(2, -1).T
    at = grid.spec.cells(transform_points(frame.inverse(), spec.centres(cells)))
    inside = ((at >= 0) & (at < grid.spec.shape)).all(axis=1)
    rows, cols = at[inside].T
    occupied, observed = np.full(len(cells), 0.5), np.zeros(len(cells), dtype=np.bool_)
    occupied[inside], observed[inside] = grid.occupied[rows, cols], grid.observed[rows, cols]
    return OccupancyGrid(spec, occupied.reshape(spec.shape), observed.reshape(spec.shape))
