"""Statistics of scores over episodes: never a figure without its interval."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats


class Interval(NamedTuple):
    """A figure and its 95 % interval."""

    value: float
    low: float
    high: float


def median(values: Sequence[float], seed: int = 0) -> Interval:
    """The median with a bootstrap 95 % interval (percentile method, 9,999 resamples).

    Of fewer than two values, or of values that are all equal, the interval is the range.
    """
    data = np.asarray(values, dtype=np.float64)
    if data.size == 0:
        return Interval(np.nan, np.nan, np.nan)
    value = float(np.median(data))
    if not np.isfinite(data).all() or np.ptp(data) == 0:
        return Interval(value, float(data.min()), float(data.max()))
    picks = np.random.default_rng(seed).integers(data.size, size=(9999, data.size))
    low, high = np.percentile(np.median(data[picks], axis=1), [2.5, 97.5])
    return Interval(value, float(low), float(high))


def share(events: Sequence[bool]) -> Interval:
    """The share of true ones with Wilson's 95 % interval."""
    n, k = len(events), int(np.sum(events))
    if n == 0:
        return Interval(np.nan, np.nan, np.nan)
    interval = stats.binomtest(k, n).proportion_ci(method="wilson")
    return Interval(k / n, float(interval.low), float(interval.high))


class Paired(NamedTuple):
    """The median difference of two series over the same episodes, and Wilcoxon's p of no shift."""

    difference: Interval
    p: float


def paired(a: Sequence[float], b: Sequence[float]) -> Paired:
    """a - b, episode by episode: median with its interval, and the signed rank test.

    p is 1 where no pair differs.
    """
    differences = np.asarray(a, dtype=np.float64) - np.asarray(b, dtype=np.float64)
    if not differences.any():
        return Paired(median(differences.tolist()), 1.0)
    p = stats.wilcoxon(differences).pvalue  # pyright: ignore[reportAttributeAccessIssue]
    return Paired(median(differences.tolist()), float(p))
