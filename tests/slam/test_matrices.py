"""Loops over (3, 3) matrices give what BLAS and LAPACK give."""

import numpy as np
import pytest

from slam.matrices import product, solved, transformed


@pytest.mark.parametrize("seed", range(5))
def test_as_numpy(seed: int) -> None:
    a, b = np.random.default_rng(seed).normal(size=(2, 3, 3))
    np.testing.assert_allclose(product(a, b), a @ b, atol=1e-12)
    np.testing.assert_allclose(transformed(a, b @ b.T), a @ b @ b.T @ a.T, atol=1e-12)
    np.testing.assert_allclose(solved(a, b), np.linalg.solve(a, b), rtol=1e-8)


def test_a_zero_on_the_diagonal_is_no_pivot() -> None:
    swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 2.0]])
    np.testing.assert_array_equal(solved(swap, np.eye(3)), np.linalg.inv(swap))
