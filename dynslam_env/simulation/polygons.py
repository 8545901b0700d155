"""Edges of moving solid polygons in the world frame, from the poses of their bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slam.geometry import Array
from slam.kernel import kernel


class Polygons:
    """The outlines of bodies, in the order of the bodies.

    shapes   corners (k, 2) of each polygon, m, in the frame of its body
    corners  (count, 2) m, of all
    first    (m + 1,) index of the first corner of each
    """

    def __init__(self, shapes: Sequence[Array]):
        self.shapes = [_counter_clockwise(np.asarray(shape)) for shape in shapes]
        self.corners = np.concatenate([np.empty((0, 2)), *self.shapes])
        self.first = np.cumsum([0, *(len(shape) for shape in self.shapes)])

    @property
    def count(self) -> int:
        """Number of edges."""
        return len(self.corners)

    def outline(self, bodies: Array, edges: Array) -> None:
        """Write the edges (count, 4), m, of bodies (m, 3 or more) at x, y (m), angle (rad).

        Counter-clockwise. The first edge of each polygon runs between its first two corners.
        """
        outline(bodies, self.first, self.corners, edges)


def regular(radius: float, corners: int) -> Array:
    """(corners, 2) m, corners of a regular polygon inscribed in a circle of `radius` m."""
    angles = np.arange(corners) * (math.tau / corners)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _counter_clockwise(shape: Array) -> Array:
    """The same polygon in counter-clockwise order, with the same first edge."""
    following = np.roll(shape, -1, axis=0)
    twice_area = (shape[:, 0] * following[:, 1] - following[:, 0] * shape[:, 1]).sum()
    return shape if twice_area > 0 else np.concatenate([shape[1::-1], shape[:1:-1]])


@kernel
def outline(bodies, first, corners, edges):
    """See `Polygons.outline`."""
    for i in range(len(bodies)):
        start, stop = first[i], first[i + 1]
        c, s = math.cos(bodies[i, 2]), math.sin(bodies[i, 2])
        for k in range(start, stop):
            x = bodies[i, 0] + c * corners[k, 0] - s * corners[k, 1]
            y = bodies[i, 1] + s * corners[k, 0] + c * corners[k, 1]
            before = stop - 1 if k == start else k - 1
            edges[k, 0] = edges[before, 2] = x
            edges[k, 1] = edges[before, 3] = y
