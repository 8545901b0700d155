"""Endpoint reading: each echo should lie on something occupied (Thrun et al. 2005, 6.4)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec, grown
from slam.interface import MapModel
from slam.scan import Scan

BLOCK = 8  # cells; side of the squares in which the field is brought up to date


class Endpoint:
    """log p(z | s, h) = beta sum_k log(z_hit max_c h_c exp(-d(e_k, c)^2 / 2 sigma^2) + z_rand).

    The logarithm is kept as a field over the cells, brought up to date where the map changed, and
    read between their centres (bilinear), so that the robot does not stick to the grid.

    beta    weight of the beams, which are not independent given a grid; 1 is the paper's
    sigma   m, how far an echo may lie from what it hit
    z_hit   share of echoes that the map explains
    z_rand  floor of an echo that it does not
    """

    H_MIN, H_MAX = 0.02, 0.98  # h is clipped to these

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
        self.known = np.zeros(self.spec.shape, np.float32)
        self.field = np.zeros(self.spec.shape, np.float32)

    def refresh(self, grid: MapModel, changed: np.ndarray) -> None:
        """Bring the field up to date around the `changed` cells (flat indices) of the map."""
        if grid.spec != self.spec:
            self._grow(grid)
        _refresh(
            self.field,
            self.known,
            grid.occupied,
            changed,
            self._kernel,
            (self.z_hit, self.z_rand),
            (self.H_MIN, self.H_MAX),
        )

    def _grow(self, grid: MapModel) -> None:
        """A field of the map's size. Its new cells are as far from anything occupied as can be."""
        spec, resolution = grid.spec, grid.spec.resolution
        if self.spec.resolution != resolution:
            self.spec = GridSpec(resolution, spec.row0, spec.col0, 0, 0)
            radius = math.ceil(3 * self.sigma / resolution)
            offsets = np.arange(-radius, radius + 1) * resolution
            self._kernel = np.exp(-0.5 * (offsets / self.sigma) ** 2).astype(np.float32)
            self.unknown = math.log(self.z_hit * max(grid.prior, self.H_MIN) + self.z_rand)
        self.known = grown(self.known, self.spec, spec, max(grid.prior, self.H_MIN))
        self.field = grown(self.field, self.spec, spec, self.unknown)
        self.spec = spec

    def log_likelihood(self, scan: Scan, poses: Array) -> Array:
        """(n,) log p(scan | pose, h) of the poses (n, 3)."""
        return self.beta * _scores(
            poses, scan.points, self.field, self.spec.origin, self.spec.resolution, self.unknown
        )


@njit(cache=True)
def _refresh(field, known, h, changed, kernel, z, limits):
    """Recompute the blocks of the field that a cell with another clipped h than before reaches."""
    rows, cols = h.shape
    radius = len(kernel) // 2
    stale = np.zeros((rows // BLOCK + 1, cols // BLOCK + 1), np.bool_)
    for cell in changed:
        row, col = cell // cols, cell % cols
        value = min(max(h[row, col], np.float32(limits[0])), np.float32(limits[1]))
        if value == known[row, col]:
            continue
        known[row, col] = value
        for i in range(max(row - radius, 0) // BLOCK, min(row + radius, rows - 1) // BLOCK + 1):
            for j in range(max(col - radius, 0) // BLOCK, min(col + radius, cols - 1) // BLOCK + 1):
                stale[i, j] = True
    across = np.empty((BLOCK + 2 * radius, BLOCK), np.float32)
    for i in range(stale.shape[0]):
        for j in range(stale.shape[1]):
            if stale[i, j]:
                _refresh_block(field, known, i * BLOCK, j * BLOCK, kernel, z, across)


@njit(cache=True)
def _refresh_block(field, known, r0, c0, kernel, z, across):
    """field = log(z_hit F + z_rand), F = max_c h_c exp(-d^2 / 2 sigma^2), rows first, then columns.

    The Gaussian of a distance is the product of one over rows and one over columns, and so is its
    maximum.
    """
    rows, cols = known.shape
    radius = len(kernel) // 2
    r1, c1 = min(r0 + BLOCK, rows), min(c0 + BLOCK, cols)
    top, bottom = max(r0 - radius, 0), min(r1 + radius, rows)
    for r in range(top, bottom):
        for c in range(c0, c1):
            best = np.float32(0.0)
            for k in range(max(c - radius, 0), min(c + radius + 1, cols)):
                best = max(best, known[r, k] * kernel[k - c + radius])
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
