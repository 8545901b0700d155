"""Which cells a scan saw free and which it saw occupied: the ground of every map model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from slam.checked import positive, within
from slam.geometry import Array, Pose2
from slam.grid import GridSpec
from slam.scan import Scan

MARGIN = 1e-6  # m
FREE, HIT = np.uint8(1), np.uint8(2)


class Seen(NamedTuple):
    """What one scan says of the cells, each cell once; a hit outweighs the beams that pass it.

    cells  (n,) int flat indices into the grid
    hit    (n,) bool, occupied rather than free
    """

    cells: np.ndarray
    hit: np.ndarray


@dataclass(frozen=True)
class Rays:
    """How far a scan is believed.

    reach          m, echoes from farther away only clear the way up to here
    no_echo_reach  m, a beam without echo clears the way up to here (or to the sensor's maximum
                   range where that is less): glass and dark walls give no echo either
    """

    reach: float = 30.0
    no_echo_reach: float = 8.0

    def __post_init__(self) -> None:
        positive(self, "reach")
        within(self, "no_echo_reach", 0.0)

    def ends(self, scan: Scan, pose: Pose2) -> tuple[Array, Array, np.ndarray]:
        """The sensor (2,), the beams' ends (n, 2) in the world, and which of them are hits (n,)."""
        believed = scan.hit | scan.no_echo
        directions, hit = scan.directions[believed], scan.hit[believed]
        clear = min(self.no_echo_reach, scan.max_range)
        lengths = np.where(hit, np.minimum(scan.ranges[believed], self.reach), clear)
        hit &= scan.ranges[believed] <= self.reach
        c, s = np.cos(pose.theta), np.sin(pose.theta)
        turn = np.array([[c, s], [-s, c]])
        sensor = np.array(scan.mount[:2]) @ turn + (pose.x, pose.y)
        return sensor, (directions * lengths[:, None]) @ turn + sensor, hit


def covering(spec: GridSpec, sensor: Array, ends: Array) -> GridSpec:
    """`spec`, grown if need be to hold the sensor (2,) and all beam ends (n, 2).

    With a little to spare: rounding puts a point on the border to this side of it or to that.
    """
    points = np.vstack([ends, sensor[None]])
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    return spec.covering(tuple(low.tolist()), tuple(high.tolist()))


def trace(spec: GridSpec, sensor: Array, ends: Array, hit: np.ndarray) -> Seen:
    """The cells that beams from `sensor` to `ends` cross (free) or end in (hit).

    All points must lie in the grid (see `covering`). A beam that is no hit frees its last cell too.
    """
    origin = np.array(spec.origin)
    scale = 1 / spec.resolution
    return Seen(*_trace((sensor - origin) * scale, (ends - origin) * scale, hit, spec.cols))


@njit(cache=True)
def _trace(sensor, ends, hit, stride):
    """Amanatides and Woo (1987) for every beam, in units of cells; marks, then collects."""
    row0 = row1 = int(np.floor(sensor[1]))
    col0 = col1 = int(np.floor(sensor[0]))
    for k in range(len(ends)):
        row, col = int(np.floor(ends[k, 1])), int(np.floor(ends[k, 0]))
        row0, row1 = min(row0, row), max(row1, row)
        col0, col1 = min(col0, col), max(col1, col)
    marks = np.zeros((row1 - row0 + 1, col1 - col0 + 1), np.uint8)
    count = 0
    for k in range(len(ends)):
        count += _mark(marks, sensor[0] - col0, sensor[1] - row0, ends[k, 0] - col0,
                       ends[k, 1] - row0, hit[k])  # fmt: skip
    cells, flags = np.empty(count, np.int64), np.empty(count, np.bool_)
    n = 0
    for row in range(marks.shape[0]):
        for col in range(marks.shape[1]):
            if marks[row, col]:
                cells[n] = (row + row0) * stride + col + col0
                flags[n] = marks[row, col] == HIT
                n += 1
    return cells, flags


@njit(cache=True)
def _mark(marks, x0, y0, x1, y1, hit):
    """Mark one beam's cells; the number of cells not marked before."""
    col, row = int(np.floor(x0)), int(np.floor(y0))
    last_col, last_row = int(np.floor(x1)), int(np.floor(y1))
    dx, dy = x1 - x0, y1 - y0
    step_col, step_row = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    delta_x = abs(1.0 / dx) if dx != 0 else np.inf
    delta_y = abs(1.0 / dy) if dy != 0 else np.inf
    next_x = (col + (dx > 0) - x0) / dx if dx != 0 else np.inf
    next_y = (row + (dy > 0) - y0) / dy if dy != 0 else np.inf
    new = 0
    for _ in range(abs(last_col - col) + abs(last_row - row)):
        if marks[row, col] == 0:
            marks[row, col] = FREE
            new += 1
        if next_x < next_y:
            next_x += delta_x
            col += step_col
        else:
            next_y += delta_y
            row += step_row
        col = min(max(col, 0), marks.shape[1] - 1)
        row = min(max(row, 0), marks.shape[0] - 1)
    if marks[last_row, last_col] == 0:
        new += 1
    if hit:
        marks[last_row, last_col] = HIT
    elif marks[last_row, last_col] == 0:
        marks[last_row, last_col] = FREE
    return new
