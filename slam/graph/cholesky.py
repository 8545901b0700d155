"""Cholesky factors of sparse symmetric matrices of (3, 3) blocks.

A general sparse LU factorisation takes three times the memory, since it stores both factors and an
index for each value. The factor's pattern follows from the elimination tree (Liu 1990), its values
column by column from those before (left-looking, as in CHOLMOD; Chen et al. 2008).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from slam.geometry import Array
from slam.kernel import kernel


class Pattern:
    """Where the factor L of a matrix of n x n blocks has blocks, with little fill.

    place   (n,) the row of L that each row of the matrix becomes
    starts  (n + 1,) of each column of L, and the end of the last; the first block of a column is on
            the diagonal
    rows    (blocks,) int32 row of each block, ascending within a column
    """

    def __init__(self, first: np.ndarray, second: np.ndarray, n: int):
        """The matrix has blocks on the diagonal, and at rows `first` (m,) and columns `second`, and
        at the same places reflected."""
        self.place = _order(first, second, n)
        low, high = _sorted(self.place[first], self.place[second])
        keys = np.unique(low[low < high] * n + high[low < high])
        begins = np.searchsorted(keys, np.arange(n + 1) * n)
        self.starts, self.rows = _filled(begins, (keys % n).astype(np.int32))

    def blocks(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(m,) int32 number of the block of L at rows `first` (m,) and columns `second` of the
        matrix, or of its reflection: the one below the diagonal."""
        low, high = _sorted(self.place[first], self.place[second])
        return _located(low, high, self.starts, self.rows)

    def solve(self, values: Array, right: Array) -> Array:
        """(n, 3) the solution x of H x = `right` (n, 3); `values` (blocks, 3, 3) are those of H
        below the diagonal, and become those of L. Raises LinAlgError unless H is positive."""
        if not _factorise(self.starts, self.rows, values):
            raise np.linalg.LinAlgError("the matrix is not positive definite")
        x = np.empty_like(right)
        x[self.place] = right
        _substitute(self.starts, self.rows, values, x)
        return x[self.place]


def _order(first: np.ndarray, second: np.ndarray, n: int) -> np.ndarray:
    """(n,) the place of each row by minimum degree (SuperLU's), of a matrix with this pattern."""
    rows = np.concatenate([first, second, np.arange(n)])
    cols = np.concatenate([second, first, np.arange(n)])
    values = np.full(len(rows), -1.0)
    values[-n:] = 1.0 + np.bincount(rows, minlength=n)  # dominates its row: no pivoting
    factors = splu(csc_matrix((values, (rows, cols)), (n, n)), permc_spec="MMD_AT_PLUS_A",
                   diag_pivot_thresh=0.0, options={"SymmetricMode": True})  # fmt: skip
    return np.asarray(factors.perm_c, dtype=np.int64)


def _sorted(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.minimum(a, b), np.maximum(a, b)


@kernel
def _filled(begins, below):
    """`starts` and `rows` of L; the rows `below` the diagonal of column k begin at begins[k]."""
    n = len(begins) - 1
    starts, parents = np.zeros(n + 1, np.int64), np.full(n, n)
    rows, size = np.empty(2 * (len(below) + n), np.int32), 0
    child, sibling = np.full(n + 1, -1), np.full(n, -1)  # of the elimination tree
    seen, mine = np.full(n, -1), np.empty(n, np.int32)
    for k in range(n):
        count = 0
        for m in range(begins[k], begins[k + 1]):
            seen[below[m]], mine[count] = k, below[m]
            count += 1
        other = child[k]
        while other >= 0:
            for m in range(starts[other] + 2, starts[other + 1]):  # all but itself and k
                if seen[rows[m]] != k:
                    seen[rows[m]], mine[count] = k, rows[m]
                    count += 1
            other = sibling[other]
        while size + count + 1 > len(rows):
            rows = np.concatenate((rows, np.empty_like(rows)))
        rows[size], rows[size + 1 : size + 1 + count] = k, np.sort(mine[:count])
        size += count + 1
        starts[k + 1] = size
        parents[k] = rows[size - count] if count else n
        sibling[k], child[parents[k]] = child[parents[k]], k
    return starts, rows[:size].copy()


@kernel
def _located(low, high, starts, rows):
    """(m,) where each row `high` is in column `low`."""
    found = np.empty(len(low), np.int32)
    for m in range(len(low)):
        begin, end = starts[low[m]], starts[low[m] + 1]
        found[m] = begin + np.searchsorted(rows[begin:end], high[m])
    return found


@kernel(error_model="numpy")
def _factorise(starts, rows, values):
    """Replace the values of H by those of L; false if H is not positive definite."""
    n = len(starts) - 1
    position = np.empty(n, np.int64)  # of each row in the present column
    upcoming = starts[:-1] + 1  # of each finished column, its first row that is still to come
    waiting, following = np.full(n, -1), np.full(n, -1)  # finished columns, by that row
    for j in range(n):
        for q in range(starts[j], starts[j + 1]):
            position[rows[q]] = q
        k = waiting[j]
        while k >= 0:
            after, p, end = following[k], upcoming[k], starts[k + 1]
            a = values[p]
            a00, a01, a02 = a[0, 0], a[0, 1], a[0, 2]
            a10, a11, a12 = a[1, 0], a[1, 1], a[1, 2]
            a20, a21, a22 = a[2, 0], a[2, 1], a[2, 2]
            for q in range(p, end):
                b, target = values[q], values[position[rows[q]]]
                for r in range(3):
                    x, y, z = b[r, 0], b[r, 1], b[r, 2]
                    target[r, 0] -= x * a00 + y * a01 + z * a02
                    target[r, 1] -= x * a10 + y * a11 + z * a12
                    target[r, 2] -= x * a20 + y * a21 + z * a22
            upcoming[k] = p + 1
            if p + 1 < end:
                row = rows[p + 1]
                following[k], waiting[row] = waiting[row], k
            k = after
        if not _finished(values[starts[j] : starts[j + 1]]):
            return False
        if starts[j] + 1 < starts[j + 1]:
            row = rows[starts[j] + 1]
            following[j], waiting[row] = waiting[row], j
    return True


@kernel(error_model="numpy")
def _finished(column):
    """Factorise the first block of a column (k, 3, 3), and divide the others by it; false if it is
    not positive definite."""
    d = column[0]
    l00 = np.sqrt(d[0, 0])
    l10, l20 = d[1, 0] / l00, d[2, 0] / l00
    l11 = np.sqrt(d[1, 1] - l10 * l10)
    l21 = (d[2, 1] - l20 * l10) / l11
    l22 = np.sqrt(d[2, 2] - l20 * l20 - l21 * l21)
    d[0, 0], d[1, 0], d[1, 1], d[2, 0], d[2, 1], d[2, 2] = l00, l10, l11, l20, l21, l22
    d[0, 1] = d[0, 2] = d[1, 2] = 0.0
    for q in range(1, len(column)):
        b = column[q]
        for r in range(3):
            b[r, 0] /= l00
            b[r, 1] = (b[r, 1] - b[r, 0] * l10) / l11
            b[r, 2] = (b[r, 2] - b[r, 0] * l20 - b[r, 1] * l21) / l22
    return l00 > 0.0 and l11 > 0.0 and l22 > 0.0


@kernel(error_model="numpy")
def _substitute(starts, rows, values, x):
    """Replace `x` (n, 3) by the solution of L L' y = x."""
    n = len(starts) - 1
    for j in range(n):
        d = values[starts[j]]
        x[j, 0] /= d[0, 0]
        x[j, 1] = (x[j, 1] - d[1, 0] * x[j, 0]) / d[1, 1]
        x[j, 2] = (x[j, 2] - d[2, 0] * x[j, 0] - d[2, 1] * x[j, 1]) / d[2, 2]
        for q in range(starts[j] + 1, starts[j + 1]):
            for r in range(3):
                for s in range(3):
                    x[rows[q], r] -= values[q, r, s] * x[j, s]
    for j in range(n - 1, -1, -1):
        for q in range(starts[j] + 1, starts[j + 1]):
            for r in range(3):
                for s in range(3):
                    x[j, s] -= values[q, r, s] * x[rows[q], r]
        d = values[starts[j]]
        x[j, 2] /= d[2, 2]
        x[j, 1] = (x[j, 1] - d[2, 1] * x[j, 2]) / d[1, 1]
        x[j, 0] = (x[j, 0] - d[1, 0] * x[j, 1] - d[2, 0] * x[j, 2]) / d[0, 0]
