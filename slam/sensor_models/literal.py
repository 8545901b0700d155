"""Literal sensor model: the probability of the map that the scan implies (eq. 7)."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import MapModel, Slope
from slam.kernel import kernel
from slam.maps.rays import WINDOW_MARGIN
from slam.maps.tiles import MASK, SHIFT
from slam.scan import Scan
from slam.sensor_models import differences
from slam.validation import positive

H_LOW, H_HIGH = 0.02, 0.98  # h is clipped to these
SHARPNESS = 0.125  # at beta 1, see `SensorModel`
ROUNDING = 1e-6


class Literal:
    """log p(z | s, h) = beta (sum_{hit cells} log h + sum_{crossed cells} log(1 - h)).

    At a given pose, a scan defines a map m_t of its own: the cells that its beams end in are
    occupied, those that they cross are free, each cell once, hits first. Equation 7, taken
    literally, is the probability of m_t given the cells' history (equation 9). There are ten times
    as many free cells as hit ones, and the set changes with the pose cell by cell: the function is
    rough, with its maxima where few cells are crossed. It is included for comparison with the
    paper, not because it works well.

    beta  weight of the cells; 1 is the paper's
    """

    levels = 1

    def __init__(self, beta: float = 0.05):
        self.beta = beta
        positive(self, "beta")
        self.sharpness = SHARPNESS / beta
        self._map_model: MapModel | None = None

    def refresh(self, map_model: MapModel, changed: np.ndarray) -> None:
        """Keep a reference to the map; h is read from it directly."""
        self._map_model = map_model

    def log_likelihood(self, scan: Scan, poses: Array, floor: float = -math.inf) -> Array:
        """(n,) log p(scan | pose, h) of the poses (n, 3); may be -inf where below `floor`."""
        assert self._map_model is not None
        cells = self._map_model.cells
        tiles, unit = cells.tiles, 1 / cells.tiles.resolution
        sensor, ends, hit = cells.rays.ends(scan, Pose2())
        farthest = np.hypot(*(ends - sensor).T).max(initial=0.0)
        side = 2 * (math.ceil(farthest * unit) + WINDOW_MARGIN) + 1
        h = min(max(cells.prior, H_LOW), H_HIGH)
        return self.beta * _sums(
            poses, sensor * unit, ends * unit, hit, np.zeros((side, side), np.int32),
            tiles.index, cells.occupied.flat, np.array(tiles.origin) * unit, unit, h,
            floor / self.beta - ROUNDING,
        )  # fmt: skip

    def slope(self, scan: Scan, pose: Pose2, level: int = 0) -> Slope:
        """Value, gradient and curvature of the log-likelihood, by central differences."""
        return differences.slope(lambda poses: self.log_likelihood(scan, poses), pose)


@kernel
def _sums(poses, sensor, ends, hit, marks, index, occupied, origin, unit, prior, floor):
    """(n,) sum of log h and log(1 - h) over the cells that the scan observes from each pose; may be
    -inf where below `floor`.

    marks  (side, side) zero at first: number of the last pose that observed a cell around the
           sensor
    """
    result = np.empty(len(poses))
    middle = len(marks) // 2
    turned = np.empty_like(ends)
    for n in range(len(poses)):
        c, s = np.cos(poses[n, 2]), np.sin(poses[n, 2])
        x0 = poses[n, 0] * unit - origin[0] + c * sensor[0] - s * sensor[1]
        y0 = poses[n, 1] * unit - origin[1] + s * sensor[0] + c * sensor[1]
        row0, col0 = np.int64(np.floor(y0)) - middle, np.int64(np.floor(x0)) - middle
        x0, y0 = x0 - col0, y0 - row0
        total = 0.0
        for k in range(len(ends)):
            dx, dy = ends[k, 0] - sensor[0], ends[k, 1] - sensor[1]
            turned[k, 0], turned[k, 1] = x0 + c * dx - s * dy, y0 + s * dx + c * dy
            if hit[k]:
                row, col = np.int64(turned[k, 1]), np.int64(turned[k, 0])
                if marks[row, col] != n + 1:
                    marks[row, col] = n + 1
                    total += np.log(_h(row + row0, col + col0, index, occupied, prior))
        product = 1.0
        for k in range(len(ends)):
            product, logs = _follow(x0, y0, turned[k, 0], turned[k, 1], marks, n + 1, row0, col0,
                                    index, occupied, prior, product)  # fmt: skip
            total += logs
            if total < floor:
                total = -np.inf
                break
        result[n] = total + np.log(product)
    return result


@kernel
def _follow(x0, y0, x1, y1, marks, mark, row0, col0, index, occupied, prior, product):
    """Multiply 1 - h of the cells that a beam crosses, those marked already aside, to `product`.

    Traverses the cells as Amanatides and Woo (1987). Returns the product, and the logarithm of the
    factors taken out of it before it underflows.
    """
    col, row = np.int64(x0), np.int64(y0)
    end_col, end_row = np.int64(x1), np.int64(y1)
    dx, dy = x1 - x0, y1 - y0
    step_col, step_row = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    delta_x = abs(1.0 / dx) if dx != 0 else np.inf
    delta_y = abs(1.0 / dy) if dy != 0 else np.inf
    next_x = (col + (dx > 0) - x0) / dx if dx != 0 else np.inf
    next_y = (row + (dy > 0) - y0) / dy if dy != 0 else np.inf
    steps, logs = abs(end_col - col) + abs(end_row - row), 0.0
    for k in range(steps + 1):
        if k == steps:
            row, col = end_row, end_col
        if marks[row, col] != mark:
            marks[row, col] = mark
            product *= 1.0 - _h(row + row0, col + col0, index, occupied, prior)
            if product < 1e-200:
                logs += np.log(product)
                product = 1.0
        if next_x < next_y:
            next_x += delta_x
            col += step_col
        else:
            next_y += delta_y
            row += step_row
    return product, logs


@kernel
def _h(row, col, index, occupied, prior):
    """P(occupied) of a cell, clipped; the prior outside of the map."""
    r, c = row >> SHIFT, col >> SHIFT
    if not (0 <= r < index.shape[0] and 0 <= c < index.shape[1]):
        return prior
    h = occupied[(np.int64(index[r, c]) << (2 * SHIFT)) + ((row & MASK) << SHIFT) + (col & MASK)]
    return min(max(np.float64(h), H_LOW), H_HIGH)
