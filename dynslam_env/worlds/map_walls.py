"""Walls from a grid map: the outlines of its occupied cells as few straight segments."""

from __future__ import annotations

import contourpy
import numpy as np

from slam.geometry import Array
from slam.grid import OccupancyGrid

FENCE = 1.0  # m, from the map to the walls around it
SMALLEST = 2.0  # cells, extent of an outline; a smaller one is a speck


def walls_of(grid: OccupancyGrid, tolerance: float) -> Array:
    """(w, 4) segments x1, y1, x2, y2, m, around all occupied cells, and a fence around the map.

    tolerance  m, by which a segment may deviate from the outline of the cells
    """
    smallest = SMALLEST * grid.spec.resolution
    rings = [ring for ring in _outlines(grid) if np.ptp(ring, axis=0).max() >= smallest]
    traced = [_segments(simplified(ring, tolerance)) for ring in rings]
    return np.vstack([*traced, _segments(_fence(grid))])


def _outlines(grid: OccupancyGrid) -> list[Array]:
    """Closed rings (k, 2), m, around occupied cells, by marching squares (contourpy)."""
    padded = np.pad(grid.solid.astype(np.float64), 1)
    rows, cols = padded.shape
    left, bottom = grid.spec.origin
    step = grid.spec.resolution
    xs, ys = left + (np.arange(cols) - 0.5) * step, bottom + (np.arange(rows) - 0.5) * step
    return contourpy.contour_generator(xs, ys, padded, line_type="Separate").lines(0.5)  # type: ignore[return-value]


def _fence(grid: OccupancyGrid) -> Array:
    left, right, bottom, top = grid.spec.extent
    left, right, bottom, top = left - FENCE, right + FENCE, bottom - FENCE, top + FENCE
    return np.array([(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)])


def _segments(ring: Array) -> Array:
    return np.hstack([ring[:-1], ring[1:]])


def simplified(ring: Array, tolerance: float) -> Array:
    """A closed ring (k, 2) with fewer points, from which none of the others is further away than
    `tolerance` m (Douglas and Peucker 1973, on the two halves between its most distant points).
    """
    far = int(np.argmax(((ring - ring[0]) ** 2).sum(axis=1)))
    kept = np.zeros(len(ring), dtype=np.bool_)
    kept[[0, far, -1]] = True
    parts = [(0, far), (far, len(ring) - 1)]
    while parts:
        first, last = parts.pop()
        worst, away = _farthest(ring, first, last)
        if away > tolerance:
            kept[worst] = True
            parts += [(first, worst), (worst, last)]
    return ring[kept]


def _farthest(ring: Array, first: int, last: int) -> tuple[int, float]:
    """The point between two that is farthest from their segment, and its distance; -1 if none."""
    if last - first < 2:
        return first, -1.0
    start, along = ring[first], ring[last] - ring[first]
    offsets = ring[first + 1 : last] - start
    shares = np.clip(offsets @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    away = np.hypot(*(offsets - shares[:, None] * along).T)
    worst = int(away.argmax())
    return first + 1 + worst, float(away[worst])
