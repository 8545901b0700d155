"""Statistics of scores over episodes, each with its confidence interval."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

RESAMPLES, MIN_RESAMPLES = 9999, 999  # of a bootstrap: fewer for large samples
MAX_DRAWN, MAX_HELD = 20_000_000, 2_000_000  # numbers drawn in total, and held in memory at once


class Interval(NamedTuple):
    """A statistic and its 95 % interval."""

    value: float
    low: float
    high: float


def median(values: Sequence[float], seed: int = 0) -> Interval:
    """The median with a bootstrap 95 % interval (percentile method, 9,999 resamples;
    fewer of more than 2,000 values, 999 at least).

    For a single value, or values that are all equal, the interval is the range; without values all
    three are NaN. A failed run may be given as infinity: the median only uses its rank.
    """
    return _bootstrap(values, lambda data: np.median(data, axis=-1), seed)


def interquartile_mean(values: Sequence[float], seed: int = 0) -> Interval:
    """The mean of the middle half (Agarwal et al. 2021), with a bootstrap interval as `median`:
    less noisy than the median, and as robust against a few failed runs."""
    return _bootstrap(values, lambda data: stats.trim_mean(data, 0.25, axis=-1), seed)


def _bootstrap(
    values: Sequence[float], statistic: Callable[[np.ndarray], np.ndarray], seed: int
) -> Interval:
    data = np.asarray(values, dtype=np.float64)
    if data.size == 0:
        return Interval(np.nan, np.nan, np.nan)
    with np.errstate(invalid="ignore"):  # infinite values may give NaN
        value = float(statistic(data))
        if np.isnan(value) or (data == data[0]).all():
            return Interval(value, float(data.min()), float(data.max()))
        found = _resampled(data, statistic, np.random.default_rng(seed))
    between = "linear" if np.isfinite(data).all() else "inverted_cdf"  # inf cannot be interpolated
    low, high = np.percentile(found[~np.isnan(found)], [2.5, 97.5], method=between)
    return Interval(value, float(low), float(high))


def _resampled(
    data: np.ndarray, statistic: Callable[[np.ndarray], np.ndarray], rng: np.random.Generator
) -> np.ndarray:
    """The statistic of bootstrap samples from `data`, each of the same size as `data`."""
    step, count = (
        max(MAX_HELD // data.size, 1),
        min(max(MAX_DRAWN // data.size, MIN_RESAMPLES), RESAMPLES),
    )
    sizes = [min(step, count - k) for k in range(0, count, step)]
    parts = [statistic(data[rng.integers(data.size, size=(n, data.size))]) for n in sizes]
    return np.concatenate(parts)


def share(events: Sequence[bool]) -> Interval:
    """The share of true events with Wilson's 95 % interval."""
    n, k = len(events), int(np.sum(events))
    if n == 0:
        return Interval(np.nan, np.nan, np.nan)
    interval = stats.binomtest(k, n).proportion_ci(method="wilson")
    return Interval(k / n, float(interval.low), float(interval.high))


class Paired(NamedTuple):
    """The median difference of two series over the same episodes, and Wilcoxon's p-value."""

    difference: Interval
    p: float


def paired(a: Sequence[float], b: Sequence[float]) -> Paired:
    """a - b for each episode: median with its interval, and Wilcoxon's signed rank test.

    p is 1 if no pair differs.
    """
    first, second = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    differences = np.zeros_like(first)
    np.subtract(first, second, out=differences, where=first != second)  # failed runs are equal
    if not differences.any():
        return Paired(median(differences.tolist()), 1.0)
    return Paired(median(differences.tolist()), _wilcoxon(differences))


MIN_PAIRS = 6  # with fewer, no difference can be significant at 5 % by Wilcoxon's test
POWER = 0.8  # probability of a verdict, where pairs_needed are there
EFFICIENCY = (
    3.0 / math.pi
)  # of Wilcoxon's test, in comparison with the t test, of normal differences


def pairs_needed(a: Sequence[float], b: Sequence[float], level: float = 0.05) -> int | None:
    """Number of pairs for a verdict at `level` with a probability of 80 %, if the differences a - b
    go on as they are; at least MIN_PAIRS. None if fewer than two of them are finite and differ.

    By the normal approximation of the t test, with the efficiency of Wilcoxon's test (Lehmann
    1975).
    """
    differences = np.asarray(a, dtype=np.float64) - np.asarray(b, dtype=np.float64)
    known = differences[np.isfinite(differences)]
    if len(known) < 2 or not abs(known.mean()) > 0:
        return None
    effect = abs(known.mean()) / max(float(known.std(ddof=1)), np.finfo(float).tiny)
    needed = ((stats.norm.isf(level / 2) + stats.norm.isf(1 - POWER)) / effect) ** 2 / EFFICIENCY
    return max(math.ceil(needed), MIN_PAIRS) if needed < MOST_NEEDED else MOST_NEEDED


MOST_NEEDED = 1_000_000  # pairs
MOST_ENUMERATED = 13  # pairs: SciPy too tries all signs of up to 13 pairs where some are tied


def _wilcoxon(differences: np.ndarray) -> float:
    """SciPy's two-sided p; where few pairs are tied or equal, in a thousandth of its time."""
    differing = differences[differences != 0]
    ranks = stats.rankdata(np.abs(differing))
    if len(np.unique(ranks)) < len(differences) <= MOST_ENUMERATED:
        return _of_all_signs(np.rint(2 * ranks).astype(int), differing > 0)
    return float(stats.wilcoxon(differences).pvalue)  # pyright: ignore[reportAttributeAccessIssue]


def _of_all_signs(ranks: np.ndarray, positive: np.ndarray) -> float:
    """Wilcoxon's p from the distribution of the sum of positive ranks (here twice the ranks, whole
    numbers) if each sign is as likely as the other."""
    ways = np.ones(1)
    for rank in ranks:
        ways = np.pad(ways, (0, rank)) + np.pad(ways, (rank, 0))
    found = ranks[positive].sum()
    tail = min(ways[: found + 1].sum(), ways[found:].sum())
    return min(2.0 * tail / ways.sum(), 1.0)


def adjusted(ps: Sequence[float]) -> list[float]:
    """p-values of several comparisons, corrected so that at most 5 % of those below 0.05 are
    expected to be false discoveries (Benjamini and Hochberg 1995)."""
    return [] if len(ps) == 0 else np.asarray(stats.false_discovery_control(ps)).tolist()


class Ranks(NamedTuple):
    """Mean rank of each of several series (1: least), and Friedman's p of no difference."""

    means: list[Interval]
    p: float


def ranks(table: np.ndarray, seed: int = 0) -> Ranks:
    """Of (episodes, series) values: ranked within each episode, ties sharing their ranks.

    The intervals are bootstrapped over the episodes. p is 1 of fewer than three series or
    episodes, and where no two series ever differ.
    """
    ranked = stats.rankdata(table, axis=1)
    means = []
    for column in ranked.T:
        means.append(_bootstrap(column.tolist(), lambda data: np.mean(data, axis=-1), seed))
    p = 1.0
    if min(table.shape) >= 3 and (ranked != ranked[:, :1]).any():
        p = float(stats.friedmanchisquare(*ranked.T).pvalue)
    return Ranks(means, p)
