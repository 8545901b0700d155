"""`dynslam compare A.jsonl B.jsonl`: what changed between two benches; a gate for regressions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import tyro
from scipy import stats

from slam.benchmark.results import Result
from slam.benchmark.statistics import Interval, adjusted, median, paired
from slam.errors import InputError
from slam.validation import number

from ..console.exits import EXIT_FOUND
from ..report.scores import COST, QUALITY, Score, present
from ..report.summary import FEWEST_PAIRS, Condition, Summary, read_rows

Key = tuple[Condition, str, int]  # condition, variant, seed
LOST = Score("failed", "lost runs", 100.0, " %", 0, worst=100.0)


class Change(NamedTuple):
    """One score of one variant under one condition, before and after.

    difference  after minus before, over the runs that both have
    q           p corrected for all changes
    """

    condition: Condition
    variant: str
    score: Score
    before: float
    difference: Interval
    pairs: int
    p: float
    q: float = 1.0

    def verdict(self, tolerance: float) -> str:
        """`better`, `worse`, or nothing: by chance, or less than a share `tolerance`."""
        if self.q >= 0.05 or self.pairs < FEWEST_PAIRS:
            return ""
        value = self.difference.value * self.score.better
        if not abs(value) > 0 or abs(value) <= tolerance * abs(self.before):
            return ""
        return "better" if value > 0 else "worse"

    def told(self, tolerance: float) -> str:
        """One line."""
        value, low, high = (self.score.told(v) for v in self.difference)
        interval = f" ({low} to {high})" if low != "-" else ""
        return (
            f"{self.verdict(tolerance) or 'same':>6}: {self.variant}, {self.condition}: "
            f"{self.score.name} {self.score.told(self.before)}{self.score.unit}, after minus "
            f"before {value}{interval}, q = {self.q:.3f}, {self.pairs} pairs"
        )


@dataclass
class CompareCommand:
    """Compare two benches of the same suite: the same variants on the same episodes, before and
    after a change of the code.

    Pairs are runs of one condition, variant and seed. Leaves with status 1 if anything is worse
    beyond chance and beyond the tolerance, or if runs came to nothing that did not before.
    """

    before: tyro.conf.Positional[Path]
    """results.jsonl of one bench, or its directory."""
    after: tyro.conf.Positional[Path]
    """results.jsonl of the other."""
    tolerance: float = 0.02
    """Share of a median by which a score may get worse."""
    time: bool = False
    """Whether time and memory count too: only where both benches ran on one quiet machine."""
    every: bool = False
    """Print what did not change as well."""

    def __call__(self) -> int:
        """Compare, print."""
        number("tolerance", self.tolerance, 0.0)
        before, after = (_rows(_found(path)) for path in (self.before, self.after))
        pairs = [(before[key], after[key]) for key in before if key in after]
        if not pairs:
            raise InputError(
                f"{self.before} and {self.after} share no run: none has the same condition, "
                f"variant and seed"
            )
        found = changes(pairs, (*QUALITY, LOST, *(COST if self.time else ())))
        broken = [new for old, new in pairs if new["error"] and not old["error"]]
        self._tell(pairs, len(before), len(after), found, broken)
        worse = any(change.verdict(self.tolerance) == "worse" for change in found)
        return EXIT_FOUND if worse or broken else 0

    def _tell(
        self,
        pairs: Sequence[tuple[Result, Result]],
        before: int,
        after: int,
        found: Sequence[Change],
        broken: Sequence[Result],
    ) -> None:
        commits = [", ".join(sorted({str(pair[k]["commit"]) for pair in pairs})) for k in (0, 1)]
        print(f"{len(pairs)} pairs of runs ({before} before, {after} after)")
        print(f"before: {commits[0]}; after: {commits[1]}")
        if any(old["episode"] != new["episode"] for old, new in pairs):
            print("the episodes themselves differ: the simulator or a log was changed")
        shown = [c for c in found if self.every or c.verdict(self.tolerance)]
        gone = before - len(pairs)
        if gone:
            print(f"{gone} of the runs before are missing after: they are not compared")
        for change in shown:
            print(change.told(self.tolerance))
        told = [change.verdict(self.tolerance) for change in found]
        print(
            f"{len(found)} comparisons: {told.count('better')} better, {told.count('worse')} "
            f"worse, {told.count('')} within chance or {100 * self.tolerance:g} %"
        )
        for row in broken[:10]:
            print(f"came to nothing: {row['variant']}, {Condition.of(row)}, seed {row['seed']}: "
                  f"{row['error']}")  # fmt: skip
        if len(broken) > 10:
            print(f"and {len(broken) - 10} more came to nothing")


def changes(pairs: Sequence[tuple[Result, Result]], scores: Sequence[Score]) -> list[Change]:
    """Every score of every variant under every condition that the pairs have."""
    groups: dict[tuple[Condition, str], list[tuple[Result, Result]]] = {}
    for old, new in pairs:
        groups.setdefault((Condition.of(old), old["variant"]), []).append((old, new))
    rows = [row for pair in pairs for row in pair]
    found = []
    for (condition, variant), group in groups.items():
        for score in present(scores, rows):
            both = [(score.of(old), score.of(new)) for old, new in group]
            known = [(a, b) for a, b in both if a is not None and b is not None]
            if known:
                found.append(_change(condition, variant, score, known))
    qs = adjusted([change.p for change in found])
    return [change._replace(q=q) for change, q in zip(found, qs, strict=True)]


def _change(
    condition: Condition, variant: str, score: Score, known: Sequence[tuple[float, float]]
) -> Change:
    old, new = zip(*known, strict=True)
    if score is LOST:
        return _lost(condition, variant, old, new)
    pair = paired(new, old)
    before = median(old).value
    return Change(condition, variant, score, before, pair.difference, len(known), pair.p)


def _lost(condition: Condition, variant: str, old: Sequence[float], new: Sequence[float]) -> Change:
    """McNemar's exact test: of the runs that were lost once only, how many after."""
    after = sum(b > a for a, b in zip(old, new, strict=True))
    once = after + sum(b < a for a, b in zip(old, new, strict=True))
    p = float(stats.binomtest(after, once).pvalue) if once else 1.0
    value = (sum(new) - sum(old)) / len(old)
    difference = Interval(value, math.nan, math.nan)
    return Change(condition, variant, LOST, sum(old) / len(old), difference, len(old), p)


def _found(path: Path) -> Path:
    return path / "results.jsonl" if path.is_dir() else path


def _rows(path: Path) -> dict[Key, Result]:
    """The runs of a bench by what they are of; a run that is there twice counts once."""
    rows = Summary(read_rows(path)).rows
    return {(Condition.of(row), row["variant"], row["seed"]): row for row in rows}
