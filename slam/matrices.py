"""(3, 3) matrices in kernels: for so few numbers BLAS and LAPACK take longer than loops."""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel


@kernel
def product(a, b):
    """a b."""
    result = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            result[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return result


@kernel
def transformed(a, covariance):
    """The covariance of a x, by that of x."""
    half, result = product(a, covariance), np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            result[i, j] = half[i, 0] * a[j, 0] + half[i, 1] * a[j, 1] + half[i, 2] * a[j, 2]
    return result


@kernel(error_model="numpy")
def solved(a, b):
    """The solution x of a x = b, by elimination with pivots."""
    a, b = a.copy(), b.copy()
    for k in range(3):
        pivot = k
        for i in range(k + 1, 3):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        for j in range(3):
            a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            b[k, j], b[pivot, j] = b[pivot, j], b[k, j]
        for i in range(3):
            factor = a[i, k] / a[k, k] if i != k else 0.0
            for j in range(3):
                a[i, j] -= factor * a[k, j]
                b[i, j] -= factor * b[k, j]
    for k in range(3):
        for j in range(3):
            b[k, j] /= a[k, k]
    return b
