import math

import numpy as np
import pytest
from scipy import stats

from slam.benchmark.statistics import median, paired, share


@pytest.mark.parametrize("seed", range(3))
def test_the_medians_interval_is_the_bootstraps(seed: int) -> None:
    values = np.random.default_rng(seed).lognormal(size=40)
    found = median(values.tolist())
    expected = stats.bootstrap(
        (values,), np.median, method="percentile", rng=np.random.default_rng(9)
    ).confidence_interval
    assert found.value == np.median(values)
    width = expected.high - expected.low
    assert found.low == pytest.approx(expected.low, abs=0.1 * width)
    assert found.high == pytest.approx(expected.high, abs=0.1 * width)


def test_the_interval_of_a_median_covers_it_about_19_times_in_20() -> None:
    rng = np.random.default_rng(1)
    covered = []
    for _ in range(60):
        found = median(rng.normal(size=31).tolist())
        covered.append(found.low <= 0.0 <= found.high)
    assert 0.85 <= np.mean(covered) <= 1.0
    assert np.mean(covered) < 1.0


def test_the_same_values_give_the_same_interval() -> None:
    assert median([1.0, 5.0, 2.0, 9.0]) == median([1.0, 5.0, 2.0, 9.0])


def test_medians_that_need_no_bootstrap() -> None:
    assert median([3.0]) == (3.0, 3.0, 3.0)
    assert median([2.0, 2.0, 2.0]) == (2.0, 2.0, 2.0)
    assert all(math.isnan(x) for x in median([]))
    assert median([1.0, 2.0, math.inf]) == (2.0, 1.0, math.inf)


@pytest.mark.parametrize(("k", "n"), [(0, 30), (3, 30), (30, 30), (1, 2)])
def test_a_share_has_wilsons_interval(k: int, n: int) -> None:
    z = stats.norm.ppf(0.975)
    middle = (k + z * z / 2) / (n + z * z)
    half = z / (n + z * z) * math.sqrt(k * (n - k) / n + z * z / 4)
    found = share([True] * k + [False] * (n - k))
    assert found == pytest.approx((k / n, middle - half, middle + half), abs=1e-9)


def test_a_share_of_nothing_is_nothing() -> None:
    assert all(math.isnan(x) for x in share([]))


def test_all_lost_is_lost() -> None:
    assert median([math.inf, math.inf]) == (math.inf, math.inf, math.inf)


def test_pairs_are_compared_episode_by_episode() -> None:
    b = [10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
    found = paired([x + d for x, d in zip(b, (1, 2, 3, 4, 5, 6), strict=True)], b)
    assert found.difference == median([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    assert found.difference.value == 3.5
    # all six of one sign: 2 of the 2^6 equally likely patterns are as far out
    assert found.p == pytest.approx(2 / 64)


def test_pairs_that_do_not_differ_have_p_of_one() -> None:
    assert paired([1.0, 2.0], [1.0, 2.0]) == ((0.0, 0.0, 0.0), 1.0)
