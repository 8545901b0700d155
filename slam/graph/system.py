"""The normal equations of a pose graph, solved for a Gauss-Newton step."""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_matrix, csc_matrix
from scipy.sparse.linalg import splu

from slam.geometry import Array
from slam.graph.edges import Edges

BLOCK_SIZE = 9  # values of a (3, 3) block


class System:
    """The normal equations of the poses from number `begin` to n - 1; those before are fixed.

    The sparsity pattern of the matrix is computed once: it is the same for all steps.

    numbers  (m,) int64, of the edges at those poses
    edges    a copy of these edges
    """

    def __init__(self, edges: Edges, n: int, begin: int = 1):
        self.numbers = np.flatnonzero(edges.ends.max(axis=1, initial=-1) >= begin)
        self.edges = edges.chosen(self.numbers)
        self._begin, self._n = begin, n - begin
        first, second = self.edges.ends.T - begin
        rows = np.stack([first, first, second, second])
        cols = np.stack([first, second, first, second])
        self._within = (rows >= 0) & (cols >= 0)
        keys = rows[self._within] * self._n + cols[self._within]
        blocks, self._block = np.unique(keys, return_inverse=True)
        starts = np.searchsorted(blocks, np.arange(self._n + 1) * self._n)
        places = np.arange(BLOCK_SIZE * len(blocks)).reshape(-1, 3, 3)
        side = 3 * self._n
        spread = bsr_matrix((places, blocks % self._n, starts), (side, side)).tocsr()
        self._order = np.asarray(spread.data, dtype=np.int64)
        self._indices, self._starts = spread.indices, spread.indptr

    def step(self, poses: Array, weights: Array) -> Array:
        """(n, 3) the Gauss-Newton step with `weights` (m,) of the edges; zero for fixed poses."""
        before, after, errors = self._jacobians(poses)
        information = self.edges.information * weights[:, None, None]
        back, forth = (np.swapaxes(J, 1, 2) @ information for J in (before, after))
        blocks = np.stack([back @ before, back @ after, forth @ before, forth @ after])
        places = BLOCK_SIZE * self._block[:, None] + np.arange(BLOCK_SIZE)
        values = np.bincount(
            places.ravel(), blocks[self._within].ravel(), minlength=len(self._order)
        )
        gradient = np.zeros((len(poses), 3))
        for ends, J in zip(self.edges.ends.T, (back, forth), strict=True):
            np.add.at(gradient, ends, (J @ errors[:, :, None])[:, :, 0])
        side = 3 * self._n
        hessian = csc_matrix((values[self._order], self._indices, self._starts), (side, side))
        solver = splu(hessian, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                      options={"SymmetricMode": True})  # fmt: skip
        step = np.zeros((len(poses), 3))
        step[self._begin :] = -solver.solve(gradient[self._begin :].ravel()).reshape(-1, 3)
        return step

    def _jacobians(self, poses: Array) -> tuple[Array, Array, Array]:
        """(m, 3, 3) Jacobians of the errors by the first and by the second pose, and the errors."""
        first, second = poses[self.edges.ends.T]
        errors = self.edges.errors(poses)
        turn = first[:, 2] + self.edges.measured[:, 2]
        c, s = np.cos(turn), np.sin(turn)
        dx, dy = (second - first)[:, :2].T
        after = np.zeros((len(first), 3, 3))
        after[:, 0, 0], after[:, 0, 1] = c, s
        after[:, 1, 0], after[:, 1, 1] = -s, c
        after[:, 2, 2] = 1.0
        before = -after
        before[:, 0, 2], before[:, 1, 2] = c * dy - s * dx, -s * dy - c * dx
        return before, after, errors
