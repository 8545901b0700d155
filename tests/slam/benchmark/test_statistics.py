import math

import numpy as np
import pytest
from scipy import stats

from slam.benchmark import statistics
from slam.benchmark.statistics import (
    adjusted,
    interquartile_mean,
    median,
    paired,
    ranks,
    share,
)


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


@pytest.mark.parametrize("pairs", [1, 2, 5, 9, 13, 14, 30])
def test_p_of_tied_pairs_is_scipys(pairs: int) -> None:
    rng = np.random.default_rng(pairs)
    for values in ([1, 1], [-1, 0, 1], [-2, -1, 0, 1, 2, 3], [-2, 1, math.inf]):
        a = np.append(rng.choice(values, pairs - 1), 1.0)
        expected = stats.wilcoxon(a)
        found = paired(a.tolist(), [0.0] * pairs).p
        assert found == pytest.approx(expected.pvalue)  # pyright: ignore[reportAttributeAccessIssue]


# -- ranks, several comparisons, lost runs ---------------------------------------------------------


def test_the_interquartile_mean_is_that_of_the_middle_half() -> None:
    values = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 100.0]
    found = interquartile_mean(values)
    assert found.value == pytest.approx(np.mean([2.0, 3.0, 4.0, 5.0]))
    expected = stats.bootstrap(
        (np.array(values),), lambda v, axis: stats.trim_mean(v, 0.25, axis=axis),
        method="percentile", rng=np.random.default_rng(1),
    ).confidence_interval  # fmt: skip
    assert found.low == pytest.approx(expected.low, abs=0.3)


def test_lost_runs_count_where_they_rank() -> None:
    inf = math.inf
    assert median([1.0, 2.0, 3.0, inf, inf]).value == 3.0
    assert median([1.0, inf, inf]).value == inf
    assert interquartile_mean([1.0, 2.0, 3.0, inf]).value == 2.5
    assert interquartile_mean([inf] * 3) == (inf, inf, inf)
    found = median([1.0, 2.0, 3.0, 4.0, inf])
    assert not any(math.isnan(number) for number in found)


def test_as_many_lost_by_one_as_by_the_other_have_no_median_and_no_warning() -> None:
    inf = math.inf
    found = paired([inf] * 3 + [1.0] * 3, [1.0] * 3 + [inf] * 3)
    assert math.isnan(found.difference.value)
    assert found.difference[1:] == (-inf, inf)
    found = paired([inf, inf, 1.0, 1.0, 2.0, 2.0], [1.0, 1.0, inf, inf, 1.0, 1.0])
    assert found.difference == (1.0, -inf, inf)  # though some draws hold no 1


def test_an_interval_does_not_depend_on_how_many_values_are_drawn_at_once(monkeypatch) -> None:
    values = np.random.default_rng(0).lognormal(size=40).tolist()
    expected = median(values)
    monkeypatch.setattr(statistics, "MAX_HELD", 40 * 7)
    assert median(values) == expected


def test_a_lost_run_is_worse_than_any_other_and_like_another_lost_one() -> None:
    inf = math.inf
    a, b = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, inf, inf], [2.0, 3.0, 4.0, 5.0, 6.0, inf, inf, 7.0]
    found = paired(a, b)
    # by hand: six pairs of which a is less, one of which b is; the largest is shared by two
    finite = [-1.0, -1.0, -1.0, -1.0, -1.0, -1e9, 0.0, 1e9]
    expected = stats.wilcoxon(finite)
    assert found.p == pytest.approx(expected.pvalue)  # pyright: ignore[reportAttributeAccessIssue]
    assert found.difference.value == -1.0
    assert paired([inf, inf], [inf, inf]).p == 1.0


def test_many_comparisons_are_corrected_as_by_benjamini_and_hochberg() -> None:
    ps = [0.01, 0.04, 0.03, 0.005]
    assert adjusted(ps) == pytest.approx([0.02, 0.04, 0.04, 0.02])
    assert adjusted([]) == []


def test_ranks_are_means_over_the_episodes() -> None:
    table = np.array([[1.0, 2.0, 3.0], [1.0, 3.0, 2.0], [2.0, 2.0, 5.0], [1.0, 2.0, math.inf]])
    found = ranks(table)
    assert [mean.value for mean in found.means] == [1.125, 2.125, 2.75]
    assert found.p == pytest.approx(stats.friedmanchisquare(*table.T).pvalue)
    assert all(mean.low <= mean.value <= mean.high for mean in found.means)


def test_ranks_of_too_little_have_p_of_one() -> None:
    assert ranks(np.array([[1.0, 2.0, 3.0]])).p == 1.0
    assert ranks(np.array([[1.0, 2.0]] * 9)).p == 1.0
    assert ranks(np.ones((5, 3))).p == 1.0


def test_the_number_of_pairs_for_a_verdict_is_what_simulation_finds():
    rng = np.random.default_rng(5)
    large = rng.normal(0.5, 1.0, 4000).tolist()
    needed = statistics.pairs_needed(large, [0.0] * 4000)
    assert needed is not None
    found = [
        statistics.paired(rng.normal(0.5, 1.0, needed).tolist(), [0.0] * needed).p < 0.05
        for _ in range(400)
    ]
    assert 0.72 < np.mean(found) < 0.88


def test_a_difference_that_never_varies_needs_six_pairs_and_none_at_all_any_number():
    assert statistics.pairs_needed([1.0, 2.0, 3.0], [0.5, 1.5, 2.5]) == 6
    assert statistics.pairs_needed([1.0, 2.0], [1.0, 2.0]) is None
    assert statistics.pairs_needed([1.0, np.inf], [0.5, 1.5]) is None
    assert statistics.pairs_needed([1.0], [0.5]) is None
