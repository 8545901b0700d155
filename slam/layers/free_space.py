"""Where a robot of some radius can drive in a map, and what it sees in a straight line."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid
from slam.kernel import kernel

COARSEST = 0.05  # m: a finer map is made as coarse as this
Point = tuple[float, float]
"""x and y, m, map frame."""
KNOWN_SHARE = 0.5  # of the parts of a cell
NEAR = 0.5  # m from a cell in which the robot fits, at most, of a pose that counts as in it
EIGHT_NEIGHBOURS = np.ones((3, 3), np.bool_)


class FreeSpace(NamedTuple):
    """The part of a map's free space in which a robot can drive.

    spec       the grid
    clearance  (rows, cols) m, from the centre of a cell to the nearest that is not free
    drivable   (rows, cols) bool
    """

    spec: GridSpec
    clearance: Array
    drivable: np.ndarray

    def sees(self, a: Point, b: Point) -> bool:
        """Whether the robot can drive straight from point `a` to `b`, m."""
        (x, y), scale = self.spec.origin, 1 / self.spec.resolution
        ends = (a[0] - x) * scale, (a[1] - y) * scale, (b[0] - x) * scale, (b[1] - y) * scale
        return bool(_clear(*ends, self.drivable))

    def room(self, point: Point) -> float:
        """m from a point to what is not free; 0 outside of the map."""
        row, col = self.spec.cells(np.array([point]))[0].tolist()
        inside = 0 <= row < self.spec.rows and 0 <= col < self.spec.cols
        return float(self.clearance[row, col]) if inside else 0.0


def free_space(grid: OccupancyGrid, radius: float, poses: Array) -> FreeSpace:
    """The free space of a map in which a robot of `radius` (m) fits, as far as it is connected with
    the `poses` (n, 3) where it drove.

    Raises InputError if it fits nowhere near any of them.
    """
    grid = _coarser(grid)
    free = grid.observed & (grid.occupied < 0.5)
    free = np.pad(free, 1)  # what is outside of the map is not free
    clearance = np.asarray(distance_transform_edt(free))[1:-1, 1:-1] * grid.spec.resolution
    fits = clearance > radius
    drivable = fits & _reached(fits, grid.spec, poses)
    if not drivable.any():
        raise InputError(
            f"a robot of radius {radius:g} m fits nowhere near the path: no routes for it"
        )
    return FreeSpace(grid.spec, clearance, drivable)


def _reached(fits: np.ndarray, spec: GridSpec, poses: Array) -> np.ndarray:
    """(rows, cols) bool: the connected parts in which a pose lies, or close to which."""
    if not fits.any():
        return fits
    labels = np.zeros(fits.shape, np.int32)
    label(fits, EIGHT_NEIGHBOURS, output=labels)
    cells = np.unique(spec.cells(poses[:, :2]), axis=0)
    cells = cells[((cells >= 0) & (cells < spec.shape)).all(axis=1)]
    found = {_nearest(labels, row, col, NEAR / spec.resolution) for row, col in cells.tolist()}
    return np.isin(labels, list(found - {0}))


def _nearest(labels: np.ndarray, row: int, col: int, reach: float) -> int:
    """The label of the nearest labelled cell, at most `reach` cells away; 0 if there is none."""
    if labels[row, col]:
        return int(labels[row, col])
    first = max(row - int(reach), 0), max(col - int(reach), 0)
    part = labels[first[0] : row + int(reach) + 1, first[1] : col + int(reach) + 1]
    rows, cols = np.nonzero(part)
    away = np.hypot(rows + first[0] - row, cols + first[1] - col)
    if away.min(initial=np.inf) > reach:
        return 0
    k = int(away.argmin())
    return int(part[rows[k], cols[k]])


def _coarser(grid: OccupancyGrid) -> OccupancyGrid:
    """A map in cells of about COARSEST: one is occupied if a part of it is, and observed if
    KNOWN_SHARE of it was, since beams leave gaps between them far away."""
    times = max(round(COARSEST / grid.spec.resolution), 1)
    if times == 1:
        return grid
    spec = grid.spec
    before = spec.row0 % times, spec.col0 % times
    after = (-(spec.row0 + spec.rows)) % times, (-(spec.col0 + spec.cols)) % times
    ends = list(zip(before, after, strict=True))
    occupied = np.pad(grid.occupied > 0.5, ends)
    observed = np.pad(grid.observed, ends)
    shape = occupied.shape[0] // times, times, occupied.shape[1] // times, times
    filled = np.asarray(occupied.reshape(shape).any(axis=(1, 3)), np.bool_)
    known = np.asarray(observed.reshape(shape).mean(axis=(1, 3)) >= KNOWN_SHARE, np.bool_)
    coarse = GridSpec(
        spec.resolution * times, spec.row0 // times, spec.col0 // times, *filled.shape
    )
    return OccupancyGrid(coarse, np.where(filled, 1.0, np.where(known, 0.0, 0.5)), known | filled)


@kernel
def _clear(x0, y0, x1, y1, drivable):
    """Whether all cells between two points, in cells from the corner, are drivable."""
    steps = int(2.0 * max(abs(x1 - x0), abs(y1 - y0))) + 1
    for k in range(steps + 1):
        x, y = x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps
        row, col = int(np.floor(y)), int(np.floor(x))
        if not (0 <= row < drivable.shape[0] and 0 <= col < drivable.shape[1]):
            return False
        if not drivable[row, col]:
            return False
    return True
