"""Surface: the cells with echoes, the mean of the echoes in each, and the surface's normal there.

The first pass. A wall fills its cells only in part, and beams that graze it cross them; so the
second pass (`cell_statistics`) tests beams against the mean and the normal of the echoes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.grid import GridSpec
from slam.kernel import kernel
from slam.maps.rays import Rays
from slam.scan import Scan

NO_SURFACE = -1  # number of a cell without an echo
FIT_RADIUS = 2  # cells around a cell whose echoes its normal is fitted to
MAX_LINE_RATIO = 0.5  # of the spreads across and along, up to which echoes are a line

Beams = tuple[Array, Array, np.ndarray]
"""The sensor (2,) and the beams' end points (n, 2), m, world; which are echoes, (n,)."""


class SurfaceCells(NamedTuple):
    """The n cells with echoes, numbered row by row.

    number   (rows, cols) int32, number of a cell, or NO_SURFACE
    cells    (n, 2) int32, rows and columns
    echoes   (n,) int64, number of echoes
    places   (n, 2) mean of the echoes, m, world
    normals  (n, 2) unit normals of the line fitted to the echoes in and around a cell; zero: none
    spread   (n,) m, standard deviation of the echoes across the line: the error of ranges and
             poses; where there is no line, the median of the others
    """

    number: np.ndarray
    cells: np.ndarray
    echoes: np.ndarray
    places: Array
    normals: Array
    spread: Array


def beams(scans: Sequence[Scan], poses: Array, rays: Rays) -> Iterator[Beams]:
    """Yield the beams of each scan at `poses` (n, 3)."""
    for scan, pose in zip(scans, poses.tolist(), strict=True):
        yield rays.ends(scan, Pose2(*pose))


def extent(scans: Sequence[Scan], poses: Array, rays: Rays, resolution: float) -> GridSpec:
    """The grid that holds every beam. Errors: InputError if it would be too large."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for sensor, ends, _ in beams(scans, poses, rays):
        low = np.minimum(low, ends.min(axis=0, initial=np.inf))
        high = np.maximum(high, ends.max(axis=0, initial=-np.inf))
        low, high = np.minimum(low, sensor), np.maximum(high, sensor)
    spare = (FIT_RADIUS + 1) * resolution
    low, high = (low - spare).tolist(), (high + spare).tolist()
    return GridSpec.around((low[0], low[1]), (high[0], high[1]), resolution)


def find_surface(scans: Sequence[Scan], poses: Array, rays: Rays, spec: GridSpec) -> SurfaceCells:
    """The cells of `spec` with echoes of the scans at `poses` (n, 3)."""
    number = np.full(spec.shape, NO_SURFACE, dtype=np.int32)
    x, y = spec.origin
    for _, ends, hit in beams(scans, poses, rays):
        _mark(ends, hit, x, y, 1 / spec.resolution, number)
    cells = np.argwhere(number != NO_SURFACE).astype(np.int32)
    number[cells[:, 0], cells[:, 1]] = np.arange(len(cells), dtype=np.int32)
    echoes, moments = np.zeros(len(cells), np.int64), np.zeros((len(cells), 5))
    for _, ends, hit in beams(scans, poses, rays):
        _gather(ends, hit, x, y, 1 / spec.resolution, number, echoes, moments)
    places, normals, spread = _fit(number, cells, echoes, moments)
    flat = normals.any(axis=1)
    spread = np.where(flat, spread, np.median(spread[flat]) if flat.any() else 0.0)
    places = places * spec.resolution + (x, y)
    return SurfaceCells(number, cells, echoes, places, normals, spread * spec.resolution)


@kernel
def _mark(ends, hit, x, y, scale, number):
    for k in range(len(ends)):
        if hit[k]:
            number[int((ends[k, 1] - y) * scale), int((ends[k, 0] - x) * scale)] = 0


@kernel
def _gather(ends, hit, x, y, scale, number, echoes, moments):
    """Sum u, v, uu, uv, vv over the echoes of each cell, in cells from its corner."""
    for k in range(len(ends)):
        if hit[k]:
            u, v = (ends[k, 0] - x) * scale, (ends[k, 1] - y) * scale
            i = number[int(v), int(u)]
            u, v = u - int(u), v - int(v)
            echoes[i] += 1
            moments[i, 0] += u
            moments[i, 1] += v
            moments[i, 2] += u * u
            moments[i, 3] += u * v
            moments[i, 4] += v * v


@kernel
def _fit(number, cells, echoes, moments):
    """(n, 2) means, from the grid's corner, (n, 2) normals, (n,) spread across; in cells."""
    places, normals = np.empty((len(cells), 2)), np.zeros((len(cells), 2))
    spread = np.zeros(len(cells))
    for i in range(len(cells)):
        row, col = cells[i]
        places[i, 0] = col + moments[i, 0] / echoes[i]
        places[i, 1] = row + moments[i, 1] / echoes[i]
        n, u, v, uu, uv, vv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for r in range(row - FIT_RADIUS, row + FIT_RADIUS + 1):
            for c in range(col - FIT_RADIUS, col + FIT_RADIUS + 1):
                j = number[r, c]
                if j >= 0:
                    m, a, b = echoes[j], c - col, r - row
                    su, sv = moments[j, 0], moments[j, 1]
                    n += m
                    u += su + m * a
                    v += sv + m * b
                    uu += moments[j, 2] + 2 * a * su + m * a * a
                    uv += moments[j, 3] + a * sv + b * su + m * a * b
                    vv += moments[j, 4] + 2 * b * sv + m * b * b
        uu, uv, vv = uu / n - (u / n) ** 2, uv / n - u * v / n**2, vv / n - (v / n) ** 2
        middle, half = (uu + vv) / 2, np.hypot((uu - vv) / 2, uv)
        spread[i] = np.sqrt(max(middle - half, 0.0))
        if middle - half < MAX_LINE_RATIO**2 * (middle + half):
            along = 0.5 * np.arctan2(2 * uv, uu - vv)
            normals[i, 0], normals[i, 1] = -np.sin(along), np.cos(along)
    return places, normals, spread
