"""FreeSpace: where a robot can drive in a grid map, and paths from place to place."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec

NODE_SPACING = 0.2  # m, between neighbouring nodes
NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))  # one of each pair of opposite steps
LEAST_SHARE = 0.6  # of the longest way, that a goal is away at least, if there is one
LEAST_NODES = 2
STRAIGHT_SHARE = 0.8  # of the clearance, that a straight leg keeps at least


class FreeSpace:
    """The largest connected part of the free cells that are `clearance` m from all others.

    spec       of the grid
    free       (rows, cols) bool
    clearance  m

    Raises InputError if there is none.
    """

    def __init__(self, spec: GridSpec, free: np.ndarray, clearance: float):
        self._spec, self._clearance = spec, clearance
        padded = distance_transform_edt(np.pad(free, 1))
        assert isinstance(padded, np.ndarray)
        self._away = padded[1:-1, 1:-1] * spec.resolution
        nodes = _nodes(self._away >= clearance, max(round(NODE_SPACING / spec.resolution), 1))
        graph = _graph(nodes, spec.resolution)
        _, part = connected_components(graph, directed=False)
        largest = np.flatnonzero(part == np.bincount(part, minlength=1).argmax())
        if len(largest) < LEAST_NODES:
            raise InputError(f"the map has no free space {clearance:g} m away from all else")
        self._graph, self._cells = graph[largest][:, largest], nodes[largest]

    def draw_path(self, length: float, rng: np.random.Generator) -> Array:
        """(p, 2) m, a shortest path of at most `length` m from a random place to another; it goes
        as far as it can where the space is smaller."""
        start = int(rng.integers(len(self._cells)))
        away, before = dijkstra(
            self._graph, directed=False, indices=start, limit=length, return_predecessors=True
        )
        reached = np.where(np.isfinite(away), away, 0.0)
        goals = np.flatnonzero(reached >= LEAST_SHARE * min(length, reached.max()))
        way = [int(rng.choice(goals))]
        while way[-1] != start:
            way.append(int(before[way[-1]]))
        return self._straightened(self._cells[way[::-1]])

    def _straightened(self, cells: np.ndarray) -> Array:
        """The centres of as few of the cells as can be joined by straight clear legs."""
        points = self._spec.centres(cells)
        kept = [0]
        while kept[-1] < len(points) - 1:
            onward = kept[-1] + 1
            while onward + 1 < len(points) and self._clear(points[kept[-1]], points[onward + 1]):
                onward += 1
            kept.append(onward)
        return points[kept]

    def _clear(self, start: Array, end: Array) -> bool:
        steps = math.ceil(math.dist(start, end) / self._spec.resolution) + 1
        points = start + np.linspace(0.0, 1.0, steps)[:, None] * (end - start)
        rows, cols = self._spec.cells(points).T
        return bool((self._away[rows, cols] >= STRAIGHT_SHARE * self._clearance).all())


def _nodes(clear: np.ndarray, stride: int) -> np.ndarray:
    """(n, 2) rows and columns of the clear cells on a coarser lattice."""
    return np.argwhere(clear[::stride, ::stride]) * stride


def _graph(nodes: np.ndarray, resolution: float) -> csr_array:
    """Lengths in m between neighbouring nodes, each pair once."""
    if not len(nodes):
        return csr_array((0, 0))
    stride = int(np.gcd.reduce(nodes, axis=None)) or 1
    lattice = nodes // stride
    index = np.full(lattice.max(axis=0) + 3, -1)
    index[lattice[:, 0] + 1, lattice[:, 1] + 1] = np.arange(len(nodes))
    pairs, lengths = [], []
    for step in NEIGHBOURS:
        rows, cols = (lattice + 1 + step).T
        other = index[rows, cols]
        found = np.flatnonzero(other >= 0)
        pairs.append(np.column_stack([found, other[found]]))
        lengths.append(np.full(len(found), math.hypot(*step) * stride * resolution))
    both = np.vstack(pairs).T
    return coo_array((np.concatenate(lengths), tuple(both)), shape=(len(nodes),) * 2).tocsr()
