"""Endpoint reading: each echo should lie on something occupied (THEORY 2; Thrun et al. 2005, 6.4)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec, Window, grown
from slam.interface import MapModel
from slam.scan import Scan


class Endpoint:
    """log p(z | s, h) = beta sum_k log(z_hit max_c h_c exp(-d(e_k, c)^2 / 2 sigma^2) + z_rand).

    The logarithm is kept as a field over the cells, brought up to date where the map changed, and
    read between their centres (bilinear), so that the robot does not stick to the grid.

    beta    weight of the beams, which are not independent given a grid; 1 is the paper's
    sigma   m, how far an echo may lie from what it hit
    z_hit   share of echoes that the map explains
    z_rand  floor of an echo that it does not
    """

    H_MIN, H_MAX = 0.02, 0.98

    def __init__(
        self, beta: float = 0.2, sigma: float = 0.06, z_hit: float = 0.95, z_rand: float = 0.05
    ):
        if min(beta, sigma, z_hit, z_rand) <= 0:
            raise InputError(
                f"Endpoint needs beta, sigma, z_hit and z_rand > 0, "
                f"got {beta}, {sigma}, {z_hit}, {z_rand}"
            )
        self.beta = beta
        self.sigma = sigma
        self.z_hit = z_hit
        self.z_rand = z_rand
        self.spec = GridSpec(1.0, 0, 0, 0, 0)
        self.field = np.zeros((0, 0), np.float32)
        self.unknown = math.log(z_rand)

    def refresh(self, grid: MapModel, changed: Window) -> None:
        """Bring the field up to date around the `changed` cells of the map."""
        if grid.spec != self.spec:
            self._grow(grid)
        radius = math.ceil(3 * self.sigma / grid.spec.resolution)
        offsets = np.arange(-radius, radius + 1) * grid.spec.resolution
        kernel = np.exp(-0.5 * (offsets / self.sigma) ** 2).astype(np.float32)
        _refresh(self.field, grid.occupied, changed, kernel, (self.z_hit, self.z_rand),
                 (self.H_MIN, self.H_MAX))  # fmt: skip

    def _grow(self, grid: MapModel) -> None:
        """A new field of the map's size; what is new in it is refreshed as unknown."""
        if self.spec.resolution != grid.spec.resolution:
            self.spec = GridSpec(grid.spec.resolution, grid.spec.row0, grid.spec.col0, 0, 0)
        prior = float(grid.occupied[~grid.observed][0]) if not grid.observed.all() else 0.0
        self.unknown = math.log(self.z_hit * prior + self.z_rand)
        self.field = grown(self.field, self.spec, grid.spec, self.unknown)
        self.spec = grid.spec

    def log_likelihood(self, scan: Scan, poses: Array) -> Array:
        """(n,) log p(scan | pose, h) of the poses (n, 3)."""
        return self.beta * _scores(
            poses, scan.points, self.field, self.spec.origin, self.spec.resolution, self.unknown
        )


@njit(cache=True)
def _refresh(field, h, changed, kernel, z, limits):
    """field = log(z_hit F + z_rand), F = max_c h_c exp(-d^2 / 2 sigma^2), rows first, then columns.

    The Gaussian of the distance is the product of one over rows and one over columns, and so is
    the maximum.
    """
    row0, row1, col0, col1 = changed
    rows, cols = h.shape
    radius = len(kernel) // 2
    r0, r1 = max(row0 - radius, 0), min(row1 + radius, rows)
    c0, c1 = max(col0 - radius, 0), min(col1 + radius, cols)
    top, bottom = max(r0 - radius, 0), min(r1 + radius, rows)
    across = np.empty((bottom - top, c1 - c0), np.float32)
    for r in range(top, bottom):
        for c in range(c0, c1):
            best = np.float32(0.0)
            for k in range(max(c - radius, 0), min(c + radius + 1, cols)):
                value = min(max(h[r, k], limits[0]), limits[1]) * kernel[k - c + radius]
                best = max(best, np.float32(value))
            across[r - top, c - c0] = best
    for r in range(r0, r1):
        for c in range(c0, c1):
            best = np.float32(0.0)
            for k in range(max(r - radius, 0), min(r + radius + 1, rows)):
                best = max(best, across[k - top, c - c0] * kernel[k - r + radius])
            field[r, c] = np.log(z[0] * best + z[1])


@njit(cache=True)
def _scores(poses, points, field, origin, resolution, unknown):
    """Sum of the field at the points seen from each pose, between the centres of four cells."""
    rows, cols = field.shape
    scale = 1.0 / resolution
    scores = np.empty(len(poses))
    for n in range(len(poses)):
        c, s = np.cos(poses[n, 2]) * scale, np.sin(poses[n, 2]) * scale
        x0 = (poses[n, 0] - origin[0]) * scale - 0.5
        y0 = (poses[n, 1] - origin[1]) * scale - 0.5
        total = 0.0
        for k in range(len(points)):
            x = x0 + c * points[k, 0] - s * points[k, 1]
            y = y0 + s * points[k, 0] + c * points[k, 1]
            if x < 0.0 or y < 0.0 or x >= cols - 1 or y >= rows - 1:
                total += unknown
                continue
            i, j = int(y), int(x)
            fy, fx = y - i, x - j
            total += (1.0 - fy) * ((1.0 - fx) * field[i, j] + fx * field[i, j + 1]) + fy * (
                (1.0 - fx) * field[i + 1, j] + fx * field[i + 1, j + 1]
            )
        scores[n] = total
    return scores
