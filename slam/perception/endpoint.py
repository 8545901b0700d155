"""Endpoint reading: each echo should lie on something occupied (Thrun et al. 2005, 6.4)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from slam.checked import positive
from slam.geometry import Array
from slam.grid import GridSpec, grown
from slam.interface import MapModel
from slam.scan import Scan

BLOCK = 8  # cells; side of the squares in which the field is brought up to date
HALF, ONE = np.float32(0.5), np.float32(1.0)
MOVED = 0.001  # m; a centroid that moved less is where it was


class Endpoint:
    """log p(z | s, h) = beta sum_k log(z_hit F(e_k) + z_rand) over the echoes e_k of a scan.

    F(e) = max_c h_c exp(-d(e, c)^2 / 2 sigma^2) over the cells c that ever gave an echo, d being
    the distance to the centroid of c's echoes; and no less than the h of the cell that e lies in.
    The logarithm is kept as a field, sampled at the centres of the cells, brought up to date where
    the map changed, and read between the samples with a quadratic B-spline: a bilinear reading
    would have its peaks at the samples, and the robot would stick to the grid.

    beta    weight of the beams, which are not independent given a grid; 1 is the paper's
    sigma   m, how far an echo may lie from what it hit
    z_hit   share of echoes that the map explains
    z_rand  floor of an echo that it does not
    """

    H_MIN, H_MAX = 0.02, 0.98  # h is clipped to these

    def __init__(
        self, beta: float = 0.2, sigma: float = 0.05, z_hit: float = 0.95, z_rand: float = 0.05
    ):
        self.beta = beta
        self.sigma = sigma
        self.z_hit = z_hit
        self.z_rand = z_rand
        positive(self, "beta", "sigma", "z_hit", "z_rand")
        self.spec = GridSpec(1.0, 0, 0, 0, 0)
        self.unknown = math.log(z_rand)
        self.known = np.zeros((0, 0, 3), np.float32)
        self.field = np.zeros((0, 0), np.float32)

    def refresh(self, grid: MapModel, changed: np.ndarray) -> None:
        """Bring the field up to date around the `changed` cells (flat indices) of the map."""
        if grid.spec != self.spec:
            changed = np.concatenate([changed, self._grow(grid)])
        stale = _take_notice(
            changed,
            grid.occupied,
            grid.centroids.offset,
            self.known,
            (self.H_MIN, self.H_MAX),
            self._radius,
        )
        model = self.sigma, self.z_hit, self.z_rand
        _refresh(stale, self.known, grid.centroids.count, self.field, self.spec.resolution,
                 self._radius, model)  # fmt: skip

    def _grow(self, grid: MapModel) -> np.ndarray:
        """A field of the map's size, unknown where it is new.

        Gives the cells (flat indices) near the old border: what they hold reaches into the new.
        """
        spec, resolution = grid.spec, grid.spec.resolution
        if not self.field.size:
            self.spec = GridSpec(resolution, spec.row0, spec.col0, 0, 0)
            self._radius = math.ceil(3 * self.sigma / resolution)
        old, prior = self.spec, max(grid.prior, self.H_MIN)
        self.unknown = math.log(self.z_hit * prior + self.z_rand)
        self.known = grown(self.known, old, spec, 0.0)
        self.known[self.known[..., 0] == 0.0, 0] = prior
        self.field = grown(self.field, old, spec, self.unknown)
        self.spec = spec
        row, col, reach = old.row0 - spec.row0, old.col0 - spec.col0, self._radius
        edge = np.zeros(spec.shape, np.bool_)
        edge[row : row + old.rows, col : col + old.cols] = True
        edge[row + reach : row + old.rows - reach, col + reach : col + old.cols - reach] = False
        edge &= grid.observed
        self.known[edge, 0] = 0.0  # which no h is, so that all of these are noticed
        return np.flatnonzero(edge)

    def log_likelihood(self, scan: Scan, poses: Array) -> Array:
        """(n,) log p(scan | pose, h) of the poses (n, 3)."""
        return self.beta * _scores(
            poses, scan.points, self.field, self.spec.origin, self.spec.resolution, self.unknown
        )


@njit(cache=True)
def _take_notice(changed, h, offset, known, limits, radius):
    """Copy clipped h and centroids of the changed cells to `known`; the blocks that they reach."""
    rows, cols = h.shape
    stale = np.zeros((rows // BLOCK + 1, cols // BLOCK + 1), np.bool_)
    for cell in changed:
        r, c = cell // cols, cell % cols
        value = min(max(h[r, c], np.float32(limits[0])), np.float32(limits[1]))
        dx, dy = offset[r, c, 0] - known[r, c, 1], offset[r, c, 1] - known[r, c, 2]
        if value == known[r, c, 0] and abs(dx) < MOVED and abs(dy) < MOVED:
            continue
        known[r, c, 0], known[r, c, 1], known[r, c, 2] = value, offset[r, c, 0], offset[r, c, 1]
        for i in range(max(r - radius, 0) // BLOCK, min(r + radius, rows - 1) // BLOCK + 1):
            for j in range(max(c - radius, 0) // BLOCK, min(c + radius, cols - 1) // BLOCK + 1):
                stale[i, j] = True
    return stale


@njit(cache=True)
def _refresh(stale, known, echoes, field, resolution, radius, model):
    """log(z_hit F + z_rand) at the centres of the cells of all stale blocks."""
    sigma, z_hit, z_rand = model
    rows, cols = field.shape
    scale = -0.5 / (sigma * sigma)
    sources = np.empty(((BLOCK + 2 * radius) ** 2, 3), np.float32)
    for i in range(stale.shape[0]):
        for j in range(stale.shape[1]):
            if not stale[i, j]:
                continue
            r0, c0 = i * BLOCK, j * BLOCK
            r1, c1 = min(r0 + BLOCK, rows), min(c0 + BLOCK, cols)
            n = 0
            for r in range(max(r0 - radius, 0), min(r1 + radius, rows)):
                for c in range(max(c0 - radius, 0), min(c1 + radius, cols)):
                    if echoes[r, c]:
                        sources[n, 0] = np.log(known[r, c, 0])
                        sources[n, 1] = (c - c0) * resolution + known[r, c, 1]
                        sources[n, 2] = (r - r0) * resolution + known[r, c, 2]
                        n += 1
            for r in range(r0, r1):
                for c in range(c0, c1):
                    x, y = (c - c0) * resolution, (r - r0) * resolution
                    best = np.log(known[r, c, 0])
                    for k in range(n):
                        dx, dy = sources[k, 1] - x, sources[k, 2] - y
                        best = max(best, sources[k, 0] + scale * (dx * dx + dy * dy))
                    field[r, c] = np.log(z_hit * np.exp(best) + z_rand)


@njit(cache=True)
def _scores(poses, points, field, origin, resolution, unknown):
    """Sum of the field at the points seen from each pose, by quadratic B-splines."""
    rows, cols = field.shape
    scale = 1.0 / resolution
    scores = np.empty(len(poses))
    for n in range(len(poses)):
        c, s = np.cos(poses[n, 2]) * scale, np.sin(poses[n, 2]) * scale
        x0, y0 = (poses[n, 0] - origin[0]) * scale, (poses[n, 1] - origin[1]) * scale
        total = 0.0
        for k in range(len(points)):
            x = x0 + c * points[k, 0] - s * points[k, 1]
            y = y0 + s * points[k, 0] + c * points[k, 1]
            if not (x >= 1.0 and y >= 1.0 and x < cols - 1 and y < rows - 1):
                total += unknown
                continue
            i, j = np.int32(y), np.int32(x)
            fy, fx = np.float32(y - i), np.float32(x - j)
            u2, v2 = HALF * fx * fx, HALF * fy * fy
            u0, v0 = HALF - fx + u2, HALF - fy + v2
            u1, v1 = ONE - u0 - u2, ONE - v0 - v2
            total += (
                v0 * (u0 * field[i - 1, j - 1] + u1 * field[i - 1, j] + u2 * field[i - 1, j + 1])
                + v1 * (u0 * field[i, j - 1] + u1 * field[i, j] + u2 * field[i, j + 1])
                + v2 * (u0 * field[i + 1, j - 1] + u1 * field[i + 1, j] + u2 * field[i + 1, j + 1])
            )
        scores[n] = total
    return scores
