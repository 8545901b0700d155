"""The results of a bench as a table for a terminal of 80 columns."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.table import Table

from slam.benchmark.results import Result
from slam.benchmark.statistics import Interval

from ..console.tables import plain_table
from ..trials.results import Condition
from .scores import F1, MEMORY, TIME, Score
from .summary import Group, Summary

MOST_ROWS = 60  # of a table with every condition; of more, the conditions are taken together
LARGE = 100.0  # numbers from here on have no decimals
SHORT = {F1: "F1", TIME: "ms", MEMORY: "MB"}
MARKS = {"better": "+", "worse": "-"}
LEGEND = (
    "lost: ATE above 0.3 m, or no result; + and -: significantly better and worse than the first "
    "(q < 0.05, six pairs or more); ms: per matched scan; all of it in the report"
)


def results_terminal(rows: Sequence[Result], order: Sequence[str]) -> Table:
    """Medians, with 95 % intervals of the main score, by condition and variant; over all conditions
    where there are too many for a terminal."""
    summary = Summary(rows, order)
    verdicts = {(one.condition, one.variant): MARKS.get(one.verdict, "")
                for one in summary.comparisons() if one.score == summary.main}  # fmt: skip
    if len(summary.groups) <= MOST_ROWS:
        sections = {str(one): summary.of(one) for one in summary.conditions}
    else:
        sections = {f"all {len(summary.conditions)} conditions": _together(summary)}
        verdicts = {}
    shown = [score for score in SHORT if any(row.get(score.key) is not None for row in rows)]
    main = [summary.main.heading] if summary.main else []
    headings = ["variant", "runs", "lost %", *(f"{name} (95 %)" for name in main), ""]
    lines: list[list[str]] = []
    for condition, groups in sections.items():
        lines.append([condition, *[""] * (len(headings) + len(shown) - 1)])
        for group in groups:
            mark = verdicts.get((group.condition, group.variant), "")
            lines.append(_line(group, summary.main, mark, shown))
    table = plain_table([*headings, *(SHORT[score] for score in shown)], lines)
    table.caption, table.caption_justify = LEGEND, "left"
    return table


def _together(summary: Summary) -> list[Group]:
    """One group a variant, of all its runs."""
    whole = Condition(())
    return [
        Group(whole, name, [row for row in summary.rows if row["variant"] == name])
        for name in summary.variants
    ]


def _line(group: Group, main: Score | None, mark: str, shown: Sequence[Score]) -> list[str]:
    line = [f"  {group.variant}", str(len(group.rows)), _number(group.failed().value, 0)]
    if main is not None:
        line.append(_with_interval(group.median(main), main))
    return [*line, mark, *(_number(group.median(s).value, s.digits) for s in shown)]


def _with_interval(interval: Interval, score: Score) -> str:
    digits = 0 if LARGE <= abs(interval.value) < math.inf else score.digits
    value, low, high = map(score._replace(digits=digits).format, interval)
    return value if value == low == high or value in ("-", "lost") else f"{value} ({low}-{high})"


def _number(value: float, digits: int) -> str:
    if math.isinf(value):
        return "lost"
    return "-" if math.isnan(value) else f"{value:.{digits}f}"
