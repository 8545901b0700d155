import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from slam.algorithms.resampling import effective, normalised, systematic

BELOW_ONE = math.nextafter(1.0, 0.0)

shares = st.lists(st.one_of(st.just(0.0), st.floats(1e-6, 1.0)), min_size=1, max_size=40)
units = st.one_of(st.floats(0.0, 1.0, exclude_max=True), st.just(BELOW_ONE))


def to_one(shares) -> np.ndarray:
    weights = np.array(shares)
    return weights / weights.sum() if weights.any() else np.full(len(shares), 1 / len(shares))


def offspring(weights, u: float) -> np.ndarray:
    return np.bincount(systematic(weights, u), minlength=len(weights))


@given(shares, units)
@example([1.0] * 30, BELOW_ONE)
@example([0.1] * 10 + [0.0], BELOW_ONE)
def test_each_has_as_many_descendants_as_its_share_rounded_up_or_down(shares, u) -> None:
    weights = to_one(shares)
    n = len(weights)
    counts = offspring(weights, u)
    assert len(counts) == n
    assert counts.sum() == n
    assert (counts >= np.floor(n * weights - 1e-9)).all()
    assert (counts <= np.ceil(n * weights + 1e-9)).all()
    assert (counts[weights == 0.0] == 0).all()


@given(shares)
def test_on_the_mean_they_have_exactly_their_share(shares) -> None:
    weights, many = to_one(shares), 400
    each = [offspring(weights, (k + 0.5) / many) for k in range(many)]
    np.testing.assert_allclose(np.mean(each, axis=0), len(weights) * weights, atol=1.01 / many)


@given(shares, units)
def test_descendants_are_in_order(shares, u) -> None:
    assert (np.diff(systematic(to_one(shares), u)) >= 0).all()


def test_by_hand() -> None:
    assert systematic(np.array([0.5, 0.1, 0.4]), 0.5).tolist() == [0, 1, 2]
    assert systematic(np.array([0.5, 0.1, 0.4]), 0.9).tolist() == [0, 2, 2]
    assert systematic(np.array([0.0, 1.0, 0.0]), 0.3).tolist() == [1, 1, 1]


@given(st.integers(1, 50), st.integers(1, 50))
def test_so_many_are_worth_what_they_weigh(n: int, more: int) -> None:
    weights = np.concatenate([np.full(n, 1 / n), np.zeros(more)])
    assert effective(weights) == pytest.approx(n)


@given(st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=20), st.floats(-1e5, 1e5))
def test_weights_are_normalised_however_small_they_are(logs, offset) -> None:
    expected = np.exp(np.array(logs)) / np.exp(np.array(logs)).sum()
    np.testing.assert_allclose(normalised(np.array(logs) + offset), expected, rtol=1e-6)
