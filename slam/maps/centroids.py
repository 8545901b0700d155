"""Where in its cell an echo came from: walls do not stand at the centres of cells."""

from __future__ import annotations

import numpy as np
from numba import njit

from slam.geometry import Array
from slam.grid import GridSpec, grown


class Centroids:
    """Per cell the mean of the echoes that fell into it, so that a map is finer than its cells.

    memory  how many echoes the mean looks back on at most: what moved is followed
    offset  (rows, cols, 2) x, y in m from the cell's centre; zero where there was no echo
    count   (rows, cols) echoes, up to `memory`
    """

    def __init__(self, spec: GridSpec, memory: int = 50):
        self.memory = memory
        self.offset = np.zeros((*spec.shape, 2), np.float32)
        self.count = np.zeros(spec.shape, np.uint16)

    def grow(self, old: GridSpec, new: GridSpec) -> None:
        """Take the shape of the larger grid `new`."""
        self.offset = grown(self.offset, old, new, 0.0)
        self.count = grown(self.count, old, new, 0)

    def add(self, spec: GridSpec, echoes: Array) -> None:
        """Take in echoes (n, 2), m in the world, all within the grid."""
        _add(
            (echoes - spec.origin) * (1 / spec.resolution),
            spec.resolution,
            self.offset,
            self.count,
            self.memory,
        )


@njit(cache=True)
def _add(echoes, resolution, offset, count, memory):
    """Running means; echoes in units of cells, rounded as `rays.trace` does."""
    for k in range(len(echoes)):
        x, y = echoes[k, 0], echoes[k, 1]
        i, j = int(np.floor(y)), int(np.floor(x))
        if count[i, j] < memory:
            count[i, j] += 1
        offset[i, j, 0] += ((x - j - 0.5) * resolution - offset[i, j, 0]) / count[i, j]
        offset[i, j, 1] += ((y - i - 0.5) * resolution - offset[i, j, 1]) / count[i, j]
