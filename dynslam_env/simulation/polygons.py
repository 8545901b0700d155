"""Edges of moving solid polygons in the world frame, from the poses of their bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slam.geometry import Array
from slam.kernel import kernel


class Polygons:
    """The outlines of bodies, in the order of the bodies.

    corners  (count, 2) m, of all, in the frames of their bodies
    first    (m + 1,) index of the first corner of each
    """

    def __init__(self, shapes: Sequence[Array]):
        """`shapes`: corners (k, 2) of each polygon, m, in the frame of its body."""
        self.corners = np.concatenate([np.empty((0, 2)), *shapes])
        self.first = np.cumsum([0, *map(len, shapes)])
        _turn_counter_clockwise(self.first, self.corners)

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


@kernel
def _turn_counter_clockwise(first, corners):
    """Put the corners of each polygon in counter-clockwise order, with the same first edge."""
    for i in range(len(first) - 1):
        shape = corners[first[i] : first[i + 1]]
        twice_area = 0.0
        for k in range(len(shape)):
            twice_area += shape[k - 1, 0] * shape[k, 1] - shape[k, 0] * shape[k - 1, 1]
        if twice_area <= 0.0:
            shape[:] = np.concatenate((shape[1::-1], shape[:1:-1]))


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
