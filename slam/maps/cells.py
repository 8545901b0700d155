"""Cells: the part that all map models share, and that sensor models read."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.kernel import kernel
from slam.maps.centroids import Centroids
from slam.maps.rays import TILE_MARGIN, WORD, ObservedCells, Rays, Tracer
from slam.maps.tiles import MASK, SHIFT, Tiles
from slam.scan import Scan
from slam.validation import positive_number

U_MASK, U_SHIFT = np.uint64(MASK), np.uint64(SHIFT)  # unsigned: numba need not check the sign


class Cells:
    """The tiles of a map, with h, the observed flag and the centroid of the echoes of every cell.

    A map model adds layers of its own (`tiles.layer`) and writes h to `occupied`.

    prior      h of a cell that was never observed
    occupied   layer of h, P(occupied now), float32
    observed   layer, bool
    centroids  of the echoes
    """

    def __init__(self, resolution: float, prior: float, rays: Rays):
        positive_number("resolution", resolution)
        self.rays = rays
        self.prior = prior
        self.tiles = Tiles(resolution)
        self.occupied = self.tiles.layer(np.float32, prior)
        self.observed = self.tiles.layer(np.bool_)
        self.centroids = Centroids(self.tiles)
        self._tracer = Tracer()

    def trace(self, scan: Scan, pose: Pose2) -> ObservedCells:
        """The cells that a scan taken at `pose` observes, marked as observed, echoes added.

        Their tiles are allocated, and copied where another map shares them: the cells may then be
        written to, as well as those within TILE_MARGIN of present and past echoes.
        """
        sensor, ends, hit = self.rays.ends(scan, pose)
        observed = self._tracer.trace(self.tiles, sensor, ends, hit)
        if self.tiles.shared:
            echoes = _echoes(observed.cells, observed.hit, self.centroids.count.flat)
            self.tiles.unshare(observed.cells, echoes, TILE_MARGIN)
        _mark(observed.cells, self.observed.flat)
        self.centroids.add(observed.echoes)
        return observed

    def observed_ids(self) -> np.ndarray:
        """(n,) int64 ids of all cells that were observed, in their order."""
        return _ids(self.observed.flat)

    def grid(self) -> OccupancyGrid:
        """A copy of the current map."""
        tiles = self.tiles
        return OccupancyGrid(tiles.spec, tiles.dense(self.occupied), tiles.dense(self.observed))

    def sample(self, points: Array) -> tuple[Array, np.ndarray]:
        """(n,) h of the cells that hold points (n, 2), m, and whether they were observed."""
        tiles = self.tiles
        return _sample(points, tiles.index, tiles.row0, tiles.col0, tiles.resolution,
                       self.occupied.flat, self.observed.flat)  # fmt: skip


@kernel(error_model="numpy")
def _sample(points, index, row0, col0, resolution, occupied, observed):
    rows, cols, scale = index.shape[0] << SHIFT, index.shape[1] << SHIFT, 1.0 / resolution
    h, known = np.zeros(len(points), np.float32), np.zeros(len(points), np.bool_)
    for k in range(len(points)):
        x, y = points[k, 0] * scale - col0, points[k, 1] * scale - row0
        if 0.0 <= x < cols and 0.0 <= y < rows:
            row, col = np.uint64(np.int64(y)), np.uint64(np.int64(x))
            tile = np.uint64(index[row >> U_SHIFT, col >> U_SHIFT])
            within = ((row & U_MASK) << U_SHIFT) + (col & U_MASK)
            cell = (tile << (U_SHIFT + U_SHIFT)) + within
            h[k], known[k] = occupied[cell], observed[cell]
    return h, known


@kernel
def _echoes(cells, hit, count):
    """(n,) bool, cells with an echo, in this scan or an earlier one."""
    echoes = np.empty(len(cells), np.bool_)
    for k in range(len(cells)):
        echoes[k] = hit[k] or count[np.uint64(cells[k])] > 0
    return echoes


@kernel
def _ids(observed):
    """(n,) the indices of true values of `observed`, which is tested in words of WORD."""
    words, n = observed.view(np.uint64), 0
    ids = np.empty(observed.sum(), np.int64)
    for w in range(len(words)):
        for k in range(WORD * w, WORD * (w + 1) if words[w] else 0):
            if observed[k]:
                ids[n] = k
                n += 1
    return ids


@kernel
def _mark(cells, observed):
    for k in range(len(cells)):
        observed[np.uint64(cells[k])] = True
