"""Solutions of sparse systems, against those of numpy's for the dense matrix."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.graph.cholesky import Pattern


def system(seed: int, n: int, pairs: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows and columns of blocks (pairs,), some of them twice, and a positive matrix (3 n, 3 n)
    that has no others."""
    rng = np.random.default_rng(seed)
    first, second = rng.integers(n, size=(2, pairs if n > 1 else 0))
    apart = first != second
    first, second = first[apart], second[apart]
    dense = np.kron(np.eye(n), np.eye(3))
    for i, j in zip(first, second, strict=True):
        J = np.zeros((3, 3 * n))
        J[:, 3 * i : 3 * i + 3], J[:, 3 * j : 3 * j + 3] = rng.normal(size=(2, 3, 3))
        dense += J.T @ J
    return first, second, dense


def block(dense: np.ndarray, i: int, j: int) -> np.ndarray:
    return dense[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]


def values_of(pattern: Pattern, first, second, dense: np.ndarray) -> np.ndarray:
    """The blocks of the matrix, where the factor's will be."""
    values = np.zeros((len(pattern.rows), 3, 3))
    for i, at in enumerate(pattern.starts[pattern.place]):
        values[at] = block(dense, i, i)
    for at, i, j in zip(pattern.blocks(first, second), first, second, strict=True):
        values[at] = block(dense, *((i, j) if pattern.place[i] > pattern.place[j] else (j, i)))
    return values


@settings(max_examples=60)
@given(st.integers(0, 2**16), st.integers(1, 30), st.integers(0, 90))
def test_solutions_are_numpys(seed: int, n: int, pairs: int) -> None:
    first, second, dense = system(seed, n, pairs)
    pattern = Pattern(first, second, n)
    right = np.random.default_rng(seed + 1).normal(size=(n, 3))
    kept = right.copy()
    x = pattern.solve(values_of(pattern, first, second, dense), right)
    np.testing.assert_allclose(x.ravel(), np.linalg.solve(dense, right.ravel()), atol=1e-8)
    np.testing.assert_array_equal(right, kept)


def test_the_factor_is_the_dense_one_and_has_blocks_nowhere_else() -> None:
    first, second, dense = system(3, 25, 40)
    pattern = Pattern(first, second, 25)
    values = values_of(pattern, first, second, dense)
    pattern.solve(values, np.zeros((25, 3)))
    order = np.argsort(pattern.place)
    turned = dense.reshape(25, 3, 25, 3)[order][:, :, order].reshape(75, 75)
    found = np.zeros((75, 75))
    for column, (begin, end) in enumerate(zip(pattern.starts, pattern.starts[1:], strict=False)):
        assert pattern.rows[begin] == column
        assert (np.diff(pattern.rows[begin:end]) > 0).all()
        for k in range(begin, end):
            block(found, pattern.rows[k], column)[...] = values[k]
    np.testing.assert_allclose(found, np.linalg.cholesky(turned), atol=1e-10)
    assert (np.abs(values).max(axis=(1, 2)) > 0.0).all()


def test_a_chain_is_not_filled() -> None:
    first = np.arange(999)
    assert len(Pattern(first, first + 1, 1000).rows) == 1000 + 999


@pytest.mark.parametrize("broken", [0.0, -1.0, np.nan])
def test_a_matrix_that_is_not_positive_is_refused(broken: float) -> None:
    first, second, dense = system(0, 4, 6)
    pattern = Pattern(first, second, 4)
    values = values_of(pattern, first, second, dense)
    values[pattern.starts[pattern.place[2]]] *= broken
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        pattern.solve(values, np.zeros((4, 3)))
