"""Changes of scores between two benches, with tests for paired runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from scipy import stats

from slam.benchmark.results import Result
from slam.benchmark.statistics import MIN_PAIRS, Interval, adjusted, median, paired, pairs_needed
from slam.errors import InputError
from slam.validation import number

from ..console.exits import EXIT_FOUND
from ..report.scores import COST, QUALITY, Score, present
from ..report.summary import Summary
from ..trials.code import OURS, Code
from ..trials.results import Condition, read_rows

if TYPE_CHECKING:
    from .compare import CompareCommand

RunKey = tuple[Condition, str, int]  # condition, variant, seed
LOST = Score("failed", "lost runs", 100.0, " %", 0, worst=100.0)


class Change(NamedTuple):
    """One score of one variant under one condition, before and after.

    before      median before
    difference  after minus before, over the paired runs
    q           p corrected for multiple comparisons
    needed      pairs for a verdict, if the differences go on as they are; None if not known
    """

    condition: Condition
    variant: str
    score: Score
    before: float
    difference: Interval
    pairs: int
    p: float
    q: float = 1.0
    needed: int | None = None

    def verdict(self, tolerance: float) -> str:
        """`better` or `worse`; empty if not significant or within the relative `tolerance`."""
        if self.q >= 0.05 or self.pairs < MIN_PAIRS:
            return ""
        value = self.difference.value * self.score.better
        if not abs(value) > 0 or abs(value) <= tolerance * abs(self.before):
            return ""
        return "better" if value > 0 else "worse"

    def one_line(self, tolerance: float) -> str:
        """The change as a line for the terminal."""
        value, low, high = (self.score.format(v) for v in self.difference)
        interval = f" ({low} to {high})" if low != "-" else ""
        return (
            f"{self.verdict(tolerance) or 'same':>6}: {self.variant}, {self.condition}: "
            f"{self.score.name} {self.score.format(self.before)}{self.score.unit}, after minus "
            f"before {value}{interval}, q = {self.q:.3f}, {self.pairs} pairs{self._more(tolerance)}"
        )

    def _more(self, tolerance: float) -> str:
        """How many pairs a verdict needs, where there is none for too few."""
        if self.verdict(tolerance) or not self.needed or self.needed <= self.pairs:
            return ""
        return f"; a verdict needs about {self.needed}"


def compare_benches(options: CompareCommand) -> int:
    """Compare, print; the exit status."""
    number("tolerance", options.tolerance, 0.0)
    before, after = (_rows(_results_file(path)) for path in (options.before, options.after))
    pairs = [(before[key], after[key]) for key in before if key in after]
    if not pairs:
        raise InputError(
            f"{options.before} and {options.after} share no run: none has the same condition, "
            f"variant and seed"
        )
    found = changes(pairs, (*QUALITY, LOST, *(COST if options.time else ())))
    broken = [new for old, new in pairs if new["error"] and not old["error"]]
    _print_changes(options, pairs, len(before), len(after), found, broken)
    worse = any(change.verdict(options.tolerance) == "worse" for change in found)
    return EXIT_FOUND if worse or broken else 0


def _print_changes(
    options: CompareCommand,
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
        print("the episodes differ: the simulator or a log was changed")
    for line in _codes(pairs):
        print(line)
    shown = [c for c in found if options.every or c.verdict(options.tolerance)]
    gone = before - len(pairs)
    if gone:
        print(f"{gone} of the runs before have no counterpart after and are not compared")
    for change in shown:
        print(change.one_line(options.tolerance))
    verdicts = [change.verdict(options.tolerance) for change in found]
    print(
        f"{len(found)} comparisons: {verdicts.count('better')} better, {verdicts.count('worse')} "
        f"worse, {verdicts.count('')} not significant or within {100 * options.tolerance:g} %"
    )
    few = sum(change.pairs < MIN_PAIRS for change in found)
    if few:
        print(f"{few} comparisons have fewer than the {MIN_PAIRS} pairs that any verdict needs")
    for row in broken[:10]:
        print(f"failed: {row['variant']}, {Condition.of(row)}, seed {row['seed']}: "
              f"{row['error']}")  # fmt: skip
    if len(broken) > 10:
        print(f"and {len(broken) - 10} more failed")


def _codes(pairs: Sequence[tuple[Result, Result]]) -> list[str]:
    """A line for each variant whose code is another one after, and for each that is not ours."""
    found: dict[str, list[str]] = {}
    for old, new in pairs:
        codes = found.setdefault(new["variant"], [])
        before, after = Code.of(old), Code.of(new)
        foreign = after is not None and after.package != OURS
        if before != after:
            codes.append(f"{before or 'unknown'} before, {after or 'unknown'} after")
        elif foreign:
            codes.append(f"{after} before and after")
    return [
        f"code of {name}: {one}" for name, codes in found.items() for one in dict.fromkeys(codes)
    ]


def changes(pairs: Sequence[tuple[Result, Result]], scores: Sequence[Score]) -> list[Change]:
    """Changes of every score of every variant under every condition."""
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
    before, needed = median(old).value, pairs_needed(new, old)
    return Change(
        condition, variant, score, before, pair.difference, len(known), pair.p, needed=needed
    )


def _lost(condition: Condition, variant: str, old: Sequence[float], new: Sequence[float]) -> Change:
    """McNemar's exact test on the runs that were lost either before or after, not both."""
    after = sum(b > a for a, b in zip(old, new, strict=True))
    once = after + sum(b < a for a, b in zip(old, new, strict=True))
    p = float(stats.binomtest(after, once).pvalue) if once else 1.0
    value = (sum(new) - sum(old)) / len(old)
    difference = Interval(value, math.nan, math.nan)
    return Change(condition, variant, LOST, sum(old) / len(old), difference, len(old), p)


def _results_file(path: Path) -> Path:
    return path / "results.jsonl" if path.is_dir() else path


def _rows(path: Path) -> dict[RunKey, Result]:
    """The runs of a bench by key; of duplicates the last one."""
    rows = Summary(read_rows(path)).rows
    return {(Condition.of(row), row["variant"], row["seed"]): row for row in rows}
