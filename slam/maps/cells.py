"""Cells: what all map models have in common, and all that a reading looks at."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.kernel import kernel
from slam.maps.centroids import Centroids
from slam.maps.rays import MARGIN, Rays, Seen, Tracer
from slam.maps.tiles import Tiles
from slam.scan import Scan
from slam.validation import positive_number


class Cells:
    """The tiles of a map, h of every cell, and where its echoes came from.

    A map model adds layers of its own (`tiles.layer`) and writes h to `occupied`.

    prior      h of a cell that nothing was seen of
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

    def see(self, scan: Scan, pose: Pose2) -> Seen:
        """The cells that a scan taken at `pose` saw; tiles are taken for them, and not shared with
        another map: the cells may be written to, and MARGIN around where echoes are or were."""
        sensor, ends, hit = self.rays.ends(scan, pose)
        seen = self._tracer.trace(self.tiles, sensor, ends, hit)
        if self.tiles.shared:
            echoes = _echoes(seen.cells, seen.hit, self.centroids.count.flat)
            self.tiles.own(seen.cells, echoes, MARGIN)
        _mark(seen.cells, self.observed.flat)
        self.centroids.add(seen.echoes)
        return seen

    def grid(self) -> OccupancyGrid:
        """The map as it is now, a copy."""
        tiles = self.tiles
        return OccupancyGrid(tiles.spec, tiles.dense(self.occupied), tiles.dense(self.observed))


@kernel
def _echoes(cells, hit, count):
    """(n,) bool, cells in which an echo is or was."""
    echoes = np.empty(len(cells), np.bool_)
    for k in range(len(cells)):
        echoes[k] = hit[k] or count[np.uint64(cells[k])] > 0
    return echoes


@kernel
def _mark(cells, observed):
    for k in range(len(cells)):
        observed[np.uint64(cells[k])] = True
