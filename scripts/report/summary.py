"""Statistics of results: per condition and variant, paired differences, ranks."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from slam.benchmark.results import Result
from slam.benchmark.statistics import (
    MIN_PAIRS,
    Interval,
    Paired,
    Ranks,
    adjusted,
    interquartile_mean,
    median,
    paired,
    ranks,
    share,
)

from ..trials.results import Condition
from .scores import ATE, BRIER, F1, F1_OVER_TIME, Score, main_score, present


class Group(NamedTuple):
    """The runs of one variant under one condition."""

    condition: Condition
    variant: str
    rows: list[Result]

    def values(self, score: Score) -> list[float]:
        """Values of the runs that have the score."""
        return [value for value in map(score.of, self.rows) if value is not None]

    def median(self, score: Score) -> Interval:
        """Median with its interval."""
        return median(self.values(score))

    def interquartile_mean(self, score: Score) -> Interval:
        """Interquartile mean with its interval."""
        return interquartile_mean(self.values(score))

    def failed(self) -> Interval:
        """Percentage of runs that were lost or failed."""
        known = any(row.get("failed") is not None for row in self.rows)
        lost = [bool(row.get("failed")) for row in self.rows] if known else []
        return Interval(*(100 * number for number in share(lost)))

    def by_episode(self, score: Score) -> dict[str, float]:
        """Values by episode and seed."""
        found = {f"{row['episode']} {row['seed']}": score.of(row) for row in self.rows}
        return {name: value for name, value in found.items() if value is not None}


class Comparison(NamedTuple):
    """A variant minus the first one, on the same episodes.

    q  p corrected for all comparisons of the report
    """

    condition: Condition
    variant: str
    baseline: str
    score: Score
    found: Paired
    pairs: int
    q: float

    @property
    def verdict(self) -> str:
        """`better` or `worse`; empty if not significant, or if the median difference is 0."""
        value = self.found.difference.value * self.score.better
        if self.pairs < MIN_PAIRS or self.q >= 0.05 or not abs(value) > 0:
            return ""
        return "better" if value > 0 else "worse"


class Wording(NamedTuple):
    """Words of a report.

    command   of `dynslam`
    compared  noun for what is compared
    """

    command: str = "bench"
    compared: str = "variant"


BENCH_WORDING = Wording()


class Summary:
    """The statistics behind the tables and figures.

    rows        sorted by condition, seed, variant
    variants    in the order in which they were named; the others are compared with the first
    conditions  sorted
    main        score that runs are compared by
    wording     of the report
    """

    def __init__(
        self, rows: Sequence[Result], order: Sequence[str] = (), wording: Wording = BENCH_WORDING
    ):
        self.wording = wording
        self.variants = _ordered([row["variant"] for row in rows], order)
        found = dict.fromkeys(Condition.of(row) for row in rows)
        self.conditions = sorted(found, key=_sortable)
        place = {name: k for k, name in enumerate(self.variants)}
        where = {condition: k for k, condition in enumerate(self.conditions)}
        self.rows = sorted(
            rows, key=lambda r: (where[Condition.of(r)], r["seed"], place[r["variant"]])
        )
        self.main = main_score(rows)
        grouped: dict[tuple[Condition, str], list[Result]] = {}
        for row in self.rows:
            grouped.setdefault((Condition.of(row), row["variant"]), []).append(row)
        self.groups = {key: Group(*key, rows) for key, rows in grouped.items()}

    def of(self, condition: Condition) -> list[Group]:
        """Groups of a condition, in the order of the variants."""
        keys = ((condition, variant) for variant in self.variants)
        return [self.groups[key] for key in keys if key in self.groups]

    def comparisons(self) -> list[Comparison]:
        """Every variant minus the first, by the main score and those of the map and the doors."""
        return self._compared

    @cached_property
    def _compared(self) -> list[Comparison]:
        found: list[Comparison] = []
        compared = dict.fromkeys((self.main, ATE, F1, F1_OVER_TIME, BRIER))
        scores = present([score for score in compared if score is not None], self.rows)
        for condition in self.conditions:
            baseline = self.groups.get((condition, self.variants[0]))
            for group in self.of(condition):
                if baseline is None or group is baseline:
                    continue
                for score in scores:
                    one, other = group.by_episode(score), baseline.by_episode(score)
                    shared = [name for name in one if name in other]
                    if shared:
                        pair = paired([one[n] for n in shared], [other[n] for n in shared])
                        names = condition, group.variant, baseline.variant
                        found.append(Comparison(*names, score, pair, len(shared), 1.0))
        qs = adjusted([comparison.found.p for comparison in found])
        return [one._replace(q=q) for one, q in zip(found, qs, strict=True)]

    def ranks(self) -> tuple[Ranks, int] | None:
        """Ranks of the variants by the main score over their common episodes, and how many these
        are; None without a score or a common episode."""
        if self.main is None or len(self.variants) < 2:
            return None
        series: dict[str, dict[str, float]] = {name: {} for name in self.variants}
        for group in self.groups.values():
            series[group.variant] |= group.by_episode(self.main)
        shared = [e for e in series[self.variants[0]] if all(e in s for s in series.values())]
        if not shared:
            return None
        table = np.array([[series[name][e] for name in self.variants] for e in shared])
        return ranks(table), len(shared)


def _ordered(names: Sequence[str], order: Sequence[str]) -> list[str]:
    """Each name once: those of `order` in its order, then the others in order of occurrence."""
    given = dict.fromkeys(names)
    return [*(name for name in order if name in given), *(n for n in given if n not in order)]


def _sortable(condition: Condition) -> tuple[tuple[str, int, float, str], ...]:
    """Sort key: numbers by size, words by the alphabet."""
    return tuple(
        (name, 0, value, "") if isinstance(value, int | float) else (name, 1, 0.0, value)
        for name, value in condition.factors
    )
