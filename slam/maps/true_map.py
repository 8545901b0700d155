"""The ground truth as a map: the walls and doors of every scan, exactly where they are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from slam.episode import Truth
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.maps.cells import Cells
from slam.maps.centroids import MAX_OFFSET, UNIT
from slam.maps.rays import Rays
from slam.maps.tiles import MASK, SHIFT
from slam.metrics.surface import sampled
from slam.scan import Scan

FREE_PROBABILITY = 0.01  # h of free cells, before and behind walls, so that no pose is favoured
SAMPLES_PER_CELL = 20  # of a segment
MARGIN_M = 10.0  # m around all segments that are allocated and free


class Outline(NamedTuple):
    """The cells that segments pass through, each once.

    cells    (n,) int64 ids
    centre   (n, 2) mean of the segments' points in each cell, from the cell's centre, in cells
    samples  (n,) number of points in the mean
    """

    cells: np.ndarray
    centre: Array
    samples: np.ndarray


EMPTY = Outline(np.empty(0, np.int64), np.empty((0, 2)), np.empty(0, np.int64))


def known_moments(truth: Array) -> Iterator[Array]:
    """The rows of `truth`, one per scan; raises InputError after the last."""
    yield from truth
    raise InputError(f"the truth is known of {len(truth)} scans, and here is one more")


class TrueMap:
    """h is 1 in cells with a wall or a door now, and FREE_PROBABILITY in all others.

    The cells' centroids lie on the segments themselves, so that the map is as exact as cells of
    this size allow: the two faces of a thin door in one cell have one centroid between them.

    truth       walls, and the doors at every scan
    resolution  m, side of a cell
    """

    def __init__(self, truth: Truth, resolution: float = 0.05):
        self.cells = Cells(resolution, FREE_PROBABILITY, Rays())
        self._moments = known_moments(truth.doors)
        self._doors: Array | None = None
        self._allocate(np.concatenate([truth.walls, truth.doors.reshape(-1, 4)]))
        self._walls = self._outline(truth.walls)
        self._doors_outline = EMPTY

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Does nothing; no cell changes."""
        return EMPTY.cells

    def advance(self) -> np.ndarray:
        """Go to the next scan, at first to scan 0; returns the ids of the cells that changed."""
        doors = next(self._moments)
        if self._doors is not None and np.array_equal(doors, self._doors):
            return EMPTY.cells
        gone, self._doors = self._doors_outline.cells, doors
        cells, centre, _ = self._doors_outline = _joined(self._walls, self._outline(doors))
        occupied, centroids = self.cells.occupied.flat, self.cells.centroids
        occupied[gone] = FREE_PROBABILITY
        centroids.count.flat[gone], centroids.offset.flat[gone] = 0, 0
        occupied[cells], centroids.count.flat[cells] = 1.0, 1
        centroids.offset.flat[cells] = np.clip(centre / UNIT, -MAX_OFFSET, MAX_OFFSET)
        return np.union1d(gone, cells)

    def _allocate(self, segments: Array) -> None:
        """Allocate all tiles around `segments` (n, 4), with all their cells observed."""
        ends = segments.reshape(-1, 2)
        if not len(ends):
            ends = np.zeros((1, 2))
        tiles = self.cells.tiles
        low, high = ends.min(axis=0) - MARGIN_M, ends.max(axis=0) + MARGIN_M
        tiles.extend((low[0], low[1]), (high[0], high[1]))
        tiles.index[:] = np.arange(1, tiles.index.size + 1).reshape(tiles.index.shape)
        tiles.allocate(tiles.index.size + 1)
        self.cells.observed.values[1:] = True

    def _outline(self, segments: Array) -> Outline:
        tiles = self.cells.tiles
        points = sampled(segments, tiles.resolution / SAMPLES_PER_CELL)
        at = (points - tiles.origin) / tiles.resolution
        cols, rows = np.floor(at).astype(np.int64).T
        slots = tiles.index[rows >> SHIFT, cols >> SHIFT].astype(np.int64)
        ids = (slots << 2 * SHIFT) + ((rows & MASK) << SHIFT) + (cols & MASK)
        return _means(ids, at % 1.0 - 0.5, np.ones(len(ids), np.int64))


def _joined(a: Outline, b: Outline) -> Outline:
    return _means(*(np.concatenate(pair) for pair in zip(a, b, strict=True)))


def _means(cells: np.ndarray, centre: Array, samples: np.ndarray) -> Outline:
    """Each cell once, with the weighted mean of its centres."""
    once, which = np.unique(cells, return_inverse=True)
    counts = np.bincount(which, samples, len(once))
    means = [np.bincount(which, samples * axis, len(once)) / counts for axis in centre.T]
    return Outline(once, np.column_stack(means), counts)
