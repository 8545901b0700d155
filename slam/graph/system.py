"""The normal equations of a pose graph, solved for a Gauss-Newton step."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from slam.geometry import Array
from slam.graph.cholesky import Pattern
from slam.graph.edges import Edges
from slam.kernel import kernel

RIDGES = 0.0, 1e-12, 1e-9  # tried one after the other: shares of the largest value on the diagonal


class System:
    """The normal equations of the poses from number `begin` to n - 1; those before are fixed.

    The sparsity pattern of the matrix is computed once: it is the same for all steps. An edge joins
    two different poses.

    numbers  (m,) int64, of the edges at those poses
    edges    a copy of these edges
    """

    def __init__(self, edges: Edges, n: int, begin: int = 1):
        self.numbers = np.flatnonzero(edges.ends.max(axis=1, initial=-1) >= begin)
        self.edges = edges.chosen(self.numbers)
        self._begin = begin
        first, second = self.edges.ends.T - begin
        free = (first >= 0) & (second >= 0)
        self._pattern = Pattern(first[free], second[free], n - begin)
        self._blocks = np.full(len(self.edges), -1, np.int32)
        self._blocks[free] = self._pattern.blocks(first[free], second[free])

    def step(self, poses: Array, weights: Array) -> Array:
        """(n, 3) the Gauss-Newton step with `weights` (m,) of the edges; zero for fixed poses.

        Where round-off leaves no positive matrix, as of a long chain with a very weak edge, its
        diagonal is raised a little (RIDGES). Raises LinAlgError for edges that are not finite.
        """
        step, diagonal = np.zeros((len(poses), 3)), self._pattern.starts[:-1]
        for ridge in RIDGES:
            values, gradient = self._assembled(poses, weights)
            if ridge:
                values[diagonal] += ridge * values[diagonal].max() * np.eye(3)
            with suppress(np.linalg.LinAlgError):
                step[self._begin :] = -self._pattern.solve(values, gradient[self._begin :])
                return step
        raise np.linalg.LinAlgError("no step fits the edges: they are not finite")

    def _assembled(self, poses: Array, weights: Array) -> tuple[Array, Array]:
        """(blocks, 3, 3) of the matrix, where `Pattern` has them, and (n, 3) the gradient."""
        pattern, edges = self._pattern, self.edges
        values, gradient = np.zeros((len(pattern.rows), 3, 3)), np.zeros((len(poses), 3))
        _assemble(
            poses, edges.ends, edges.measured, edges.errors(poses), edges.information, weights,
            self._begin, pattern.place, pattern.starts, self._blocks, values, gradient,
        )  # fmt: skip
        return values, gradient


@kernel
def _assemble(
    poses, ends, measured, errors, information, weights, begin, place, starts, blocks, values,
    gradient,
):  # fmt: skip
    """Add the edges to the blocks of the matrix (k, 3, 3) and to the gradient (n, 3).

    blocks  (m,) of the matrix, which each edge adds to beside those on the diagonal; -1: none
    """
    for k in range(len(ends)):
        first, second = ends[k]
        before, after = jacobians(poses[first], poses[second], measured[k, 2])
        weighted = information[k] * weights[k]
        back, forth = before.T @ weighted, after.T @ weighted
        gradient[first] += back @ errors[k]
        gradient[second] += forth @ errors[k]
        if first >= begin:
            values[starts[place[first - begin]]] += back @ before
        if second >= begin:
            values[starts[place[second - begin]]] += forth @ after
        if blocks[k] >= 0:
            lower = place[first - begin] > place[second - begin]
            values[blocks[k]] += back @ after if lower else forth @ before


@kernel
def jacobians(first, second, turn):
    """(3, 3) derivatives of the error of an edge by its `first` and its `second` pose (3,), if it
    measured a turn of `turn` rad."""
    c, s = np.cos(first[2] + turn), np.sin(first[2] + turn)
    dx, dy = second[0] - first[0], second[1] - first[1]
    after = np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)])
    before = -after
    before[0, 2], before[1, 2] = c * dy - s * dx, -s * dy - c * dx
    return before, after
