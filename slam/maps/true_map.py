"""The truth as a map: what stands, exactly where it stands, scan after scan. Nothing is learned."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from slam.episode import Truth
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.maps.cells import Cells
from slam.maps.centroids import UNIT
from slam.maps.rays import Rays
from slam.maps.tiles import MASK, SHIFT
from slam.metrics.surface import sampled
from slam.scan import Scan

FREE = 0.01  # h where nothing stands: in front of a wall and behind it, or the robot would be drawn
FINENESS = 20  # samples per cell and segment
LARGEST = np.iinfo(np.int16).max
BEYOND = 10.0  # m around all that ever stands: as far as the map says that it is free


class Outline(NamedTuple):
    """The cells that segments pass through, each once.

    cells    (n,) int64 ids
    centre   (n, 2) mean of the segments' points within each, from the cell's middle, in cells
    samples  (n,) how many points that is the mean of
    """

    cells: np.ndarray
    centre: Array
    samples: np.ndarray


NOTHING = Outline(np.empty(0, np.int64), np.empty((0, 2)), np.empty(0, np.int64))


def known_moments(truth: Array) -> Iterator[Array]:
    """What is true at one scan after the other; raises InputError after the last."""
    yield from truth
    raise InputError(f"the truth is known of {len(truth)} scans, and here is one more")


class TrueMap:
    """h is 1 where a wall or a door stands now, and as low as can be everywhere else.

    The cells' centroids lie on the segments themselves, so that the map is as exact as cells of
    this size can be: two faces of a thin door, in one cell, have one centroid between them.

    truth       walls, and the doors scan by scan
    resolution  m, side of a cell
    """

    def __init__(self, truth: Truth, resolution: float = 0.05):
        self.cells = Cells(resolution, FREE, Rays())
        self._moments = known_moments(truth.doors)
        self._doors: Array | None = None
        self._tiled(np.concatenate([truth.walls, truth.doors.reshape(-1, 4)]))
        self._walls = self._outline(truth.walls)
        self._standing = NOTHING

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Learns nothing; no cell changes."""
        return NOTHING.cells

    def advance(self) -> np.ndarray:
        """On to the next scan, from before the first one on; gives the ids of what changed."""
        doors = next(self._moments)
        if self._doors is not None and np.array_equal(doors, self._doors):
            return NOTHING.cells
        gone, self._doors = self._standing.cells, doors
        cells, centre, _ = self._standing = _joined(self._walls, self._outline(doors))
        occupied, centroids = self.cells.occupied.flat, self.cells.centroids
        occupied[gone], centroids.count.flat[gone], centroids.offset.flat[gone] = FREE, 0, 0
        occupied[cells], centroids.count.flat[cells] = 1.0, 1
        centroids.offset.flat[cells] = np.clip(centre / UNIT, -LARGEST, LARGEST)
        return np.union1d(gone, cells)

    def _tiled(self, segments: Array) -> None:
        """Take all tiles around the `segments` (n, 4) into use, and know all of their cells."""
        ends = segments.reshape(-1, 2)
        if not len(ends):
            ends = np.zeros((1, 2))
        tiles = self.cells.tiles
        low, high = ends.min(axis=0) - BEYOND, ends.max(axis=0) + BEYOND
        tiles.cover((low[0], low[1]), (high[0], high[1]))
        tiles.index[:] = np.arange(1, tiles.index.size + 1).reshape(tiles.index.shape)
        tiles.take(tiles.index.size + 1)
        self.cells.observed.values[1:] = True

    def _outline(self, segments: Array) -> Outline:
        tiles = self.cells.tiles
        points = sampled(segments, tiles.resolution / FINENESS)
        at = (points - tiles.origin) / tiles.resolution
        cols, rows = np.floor(at).astype(np.int64).T
        slots = tiles.index[rows >> SHIFT, cols >> SHIFT].astype(np.int64)
        ids = (slots << 2 * SHIFT) + ((rows & MASK) << SHIFT) + (cols & MASK)
        return _means(ids, at % 1.0 - 0.5, np.ones(len(ids), np.int64))


def _joined(a: Outline, b: Outline) -> Outline:
    return _means(*(np.concatenate(pair) for pair in zip(a, b, strict=True)))


def _means(cells: np.ndarray, centre: Array, samples: np.ndarray) -> Outline:
    """Each cell once, with the mean of all that was said of it."""
    once, which = np.unique(cells, return_inverse=True)
    counts = np.bincount(which, samples, len(once))
    means = [np.bincount(which, samples * axis, len(once)) / counts for axis in centre.T]
    return Outline(once, np.column_stack(means), counts)
