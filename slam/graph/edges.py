"""The edges of a pose graph: measured displacements between its poses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, between

INITIAL_EDGES = 16  # capacity of the arrays, which is doubled when they are full


class Edge(NamedTuple):
    """A measured displacement between two poses.

    first, second  numbers of the poses
    displacement   of the second relative to the first
    information    (3, 3) inverse covariance of x, y in m and theta in rad, in the second's frame
    loop           whether it closes a loop, and may be an outlier
    """

    first: int
    second: int
    displacement: Pose2
    information: Array
    loop: bool = False


class Edges:
    """A growing list of edges, also available as arrays: views, which later edges may outdate."""

    def __init__(self, edges: Iterable[Edge] = ()):
        self._n = 0
        self._ends = np.empty((INITIAL_EDGES, 2), np.int64)
        self._measured = np.empty((INITIAL_EDGES, 3))
        self._information = np.empty((INITIAL_EDGES, 3, 3))
        self._loops = np.empty(INITIAL_EDGES, np.bool_)
        self.extend(edges)

    def append(self, edge: Edge) -> None:
        """Add an edge."""
        n = self._n
        if n == len(self._ends):
            self._ends, self._measured = _doubled(self._ends), _doubled(self._measured)
            self._information, self._loops = _doubled(self._information), _doubled(self._loops)
        self._ends[n], self._measured[n] = edge[:2], edge.displacement
        self._information[n], self._loops[n] = edge.information, edge.loop
        self._n = n + 1

    def extend(self, edges: Iterable[Edge]) -> None:
        """Add edges."""
        for edge in edges:
            self.append(edge)

    def __len__(self) -> int:
        return self._n

    def __iter__(self) -> Iterator[Edge]:
        for k in range(self._n):
            yield self[k]

    def __getitem__(self, number: int) -> Edge:
        first, second = self.ends[number].tolist()
        information = self.information[number].copy()
        return Edge(
            first, second, Pose2.of(self.measured[number]), information, bool(self.loops[number])
        )

    def errors(self, poses: Array) -> Array:
        """(edges, 3) measured displacements minus those of `poses` (n, 3), in the second frame."""
        first, second = self.ends.T
        return between(self.measured, between(poses[first], poses[second]))

    def squares(self, poses: Array) -> Array:
        """(edges,) e' Omega e of the errors."""
        errors = self.errors(poses)
        return np.einsum("ni,nij,nj->n", errors, self.information, errors)

    def chosen(self, numbers: np.ndarray) -> Edges:
        """A copy of the edges with (m,) `numbers`."""
        result = Edges()
        result._n = len(numbers)
        result._ends, result._measured = self.ends[numbers], self.measured[numbers]
        result._information, result._loops = self.information[numbers], self.loops[numbers]
        return result

    @property
    def ends(self) -> np.ndarray:
        """(edges, 2) int64, first and second pose."""
        return self._ends[: self._n]

    @property
    def measured(self) -> Array:
        """(edges, 3) displacements."""
        return self._measured[: self._n]

    @property
    def information(self) -> Array:
        """(edges, 3, 3) of the displacements."""
        return self._information[: self._n]

    @property
    def loops(self) -> np.ndarray:
        """(edges,) bool, whether they close loops."""
        return self._loops[: self._n]


def _doubled(array: np.ndarray) -> np.ndarray:
    return np.concatenate([array, np.empty_like(array)])
