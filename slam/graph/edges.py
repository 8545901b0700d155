"""The edges of a pose graph: measured displacements between its poses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, between
from slam.graph.covariance import carried, carried_back, covariance_of

INITIAL_EDGES = 16  # capacity of the arrays, which is doubled when they are full
MEASURED = np.zeros((3, 3))  # covariance that an edge is given beside what was measured: none


class Edge(NamedTuple):
    """A measured displacement between two poses.

    first, second  numbers of the poses
    displacement   of the second relative to the first
    information    (3, 3) inverse covariance of x, y in m and theta in rad, in the second's frame
    loop           whether it closes a loop, and may be an outlier
    given          (3, 3) covariance in m and rad that no match has measured, in the same frame
    """

    first: int
    second: int
    displacement: Pose2
    information: Array
    loop: bool = False
    given: Array = MEASURED

    @property
    def reversed(self) -> Edge:
        """The same displacement, from the second pose to the first."""
        move = np.array(self.displacement)
        measured = carried_back(covariance_of(self.information), move)
        return Edge(
            self.second, self.first, self.displacement.inverse(), np.linalg.inv(measured),
            self.loop, carried_back(self.given, move),
        )  # fmt: skip

    def followed_by(self, other: Edge) -> Edge:
        """The edge from the first pose to the second of an `other` edge, which begins at the second
        of this one; both errors are added. It closes a loop if one of the two does."""
        move = np.array(other.displacement)
        measured = carried(covariance_of(self.information), move)
        return Edge(
            self.first, other.second, self.displacement @ other.displacement,
            np.linalg.inv(measured + covariance_of(other.information)), self.loop or other.loop,
            carried(self.given, move) + other.given,
        )  # fmt: skip


class Edges:
    """A growing list of edges, also available as arrays: views, which later edges may outdate."""

    def __init__(self, edges: Iterable[Edge] = ()):
        self._n = 0
        self._ends = np.empty((INITIAL_EDGES, 2), np.int64)
        self._measured = np.empty((INITIAL_EDGES, 3))
        self._information = np.empty((INITIAL_EDGES, 3, 3))
        self._loops = np.empty(INITIAL_EDGES, np.bool_)
        self._given = np.empty((INITIAL_EDGES, 3, 3))
        self.extend(edges)

    @classmethod
    def of(cls, ends: np.ndarray, measured: Array, information: Array) -> Edges:
        """Edges that close no loop: (n, 2) poses, (n, 3) displacements, (n, 3, 3) information."""
        result, n = cls(), len(ends)
        result._n, result._ends = n, ends
        result._measured, result._information = measured, information
        result._loops, result._given = np.zeros(n, np.bool_), np.zeros((n, 3, 3))
        return result

    def append(self, edge: Edge) -> None:
        """Add an edge."""
        n = self._n
        if n == len(self._ends):
            self._ends, self._measured = _doubled(self._ends), _doubled(self._measured)
            self._information, self._loops = _doubled(self._information), _doubled(self._loops)
            self._given = _doubled(self._given)
        self._n = n + 1
        self[n] = edge

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
        information, given = self.information[number].copy(), self.given[number].copy()
        measured, loop = Pose2.of(self.measured[number]), bool(self.loops[number])
        return Edge(first, second, measured, information, loop, given)

    def __setitem__(self, number: int, edge: Edge) -> None:
        self._ends[number], self._measured[number] = edge[:2], edge.displacement
        self._information[number], self._loops[number] = edge.information, edge.loop
        self._given[number] = edge.given

    def remove(self, numbers: Iterable[int]) -> None:
        """Remove edges; those after them move up."""
        left = np.delete(np.arange(self._n), list(numbers))
        self.__dict__.update(self.chosen(left).__dict__)

    def remove_pose(self, number: int) -> None:
        """Renumber the poses after one that has no edges any more."""
        self.ends[...] -= self.ends > number

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
        result._given = self.given[numbers]
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

    @property
    def given(self) -> Array:
        """(edges, 3, 3) covariances that no match has measured."""
        return self._given[: self._n]


def _doubled(array: np.ndarray) -> np.ndarray:
    room = np.empty((max(len(array), 1), *array.shape[1:]), array.dtype)
    return np.concatenate([array, room])
