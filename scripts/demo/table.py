"""The table of an experiment: variant x {static, moving doors}, medians over the episodes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from rich.box import HORIZONTALS
from rich.table import Table

from slam.benchmark.results import Result
from slam.benchmark.statistics import Interval, median, share

from ..report.scores import ATE, BRIER, F1, HEADING, TIME, Score

MARKDOWN_HEADINGS = (
    "variant",
    "doors",
    "ATE, mm",
    "largest heading error, deg",
    "F1 at 5 cm",
    "Brier of doors",
    "failed, %",
    "ms per match",
)
BOUND = "bound"
"""Name of the last rows: the lower bound of the ATE for one scan in the known map."""
COLUMN_LEGEND = (
    "ATE: absolute trajectory error; bound: its Cramer-Rao bound for one scan in the true map; "
    "deg: largest heading error; F1: of the walls, within 5 cm; Brier: of the map against the "
    "share of time that the doors' cells were occupied, less is better; fail: ATE above 0.3 m; "
    "ms: time per matched scan"
)


class TableRow(NamedTuple):
    """The scores of one variant under one door law."""

    variant: str
    doors: str
    ate_mm: Interval
    heading_deg: Interval
    f1: Interval
    brier: Interval
    failed_percent: Interval
    ms: Interval

    @property
    def ate_digits(self) -> int:
        """Decimals of the ATE; the bound is a few millimetres."""
        return 1 if self.variant == BOUND else 0


def summary(results: Sequence[Result]) -> list[TableRow]:
    """One row per variant and door law, in the order of their first results."""
    groups: dict[tuple[str, str], list[Result]] = {}
    for result in results:
        groups.setdefault((result["variant"], result["doors"]), []).append(result)
    order = list(dict.fromkeys(variant for variant, _ in groups))
    keys = sorted(groups, key=lambda key: order.index(key[0]))
    return [_row(*key, groups[key]) for key in keys] + _bounds(results)


def _bounds(results: Sequence[Result]) -> list[TableRow]:
    """One row per door law: the median of the bounds of its episodes."""
    episodes = {(row["doors"], row["seed"]): row.get("ate_bound") for row in results}
    nothing = median([])
    rows = []
    for law in dict.fromkeys(doors for doors, _ in episodes):
        bounds = [1e3 * b for (doors, _), b in episodes.items() if doors == law and b is not None]
        if bounds:
            ate = median(bounds)
            rows.append(TableRow(BOUND, law, ate, nothing, nothing, nothing, nothing, nothing))
    return rows


def _row(variant: str, doors: str, group: Sequence[Result]) -> TableRow:
    def of(score: Score) -> Interval:
        values = [score.of(row) for row in group]
        return median([math.nan if value is None else value for value in values])

    failed = share([row["failed"] for row in group])
    return TableRow(
        variant,
        doors,
        of(ATE),
        of(HEADING),
        of(F1),
        of(BRIER),
        Interval(*(100 * number for number in failed)),
        of(TIME),
    )


def markdown(results: Sequence[Result]) -> str:
    """The table in Markdown, each median with its 95 % interval."""
    lines = [MARKDOWN_HEADINGS, ("---",) * len(MARKDOWN_HEADINGS)]
    for row in summary(results):
        digits = (row.ate_digits, 1, 2, 2, 0)
        intervals = [_interval(i, d) for i, d in zip(row[2:7], digits, strict=True)]
        lines.append((row.variant, row.doors, *intervals, _number(row.ms.value, 2)))
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def terminal(results: Sequence[Result], title: str) -> Table:
    """The table for a terminal of 80 columns."""
    table = Table(title=title, title_justify="left", box=HORIZONTALS, padding=0)
    table.caption, table.caption_justify = COLUMN_LEGEND, "left"
    for heading in ("variant", "doors", "ATE, mm (95 %)", "deg", "F1", "Brier", "fail", "ms"):
        table.add_column(heading, no_wrap=True)
    for row in summary(results):
        table.add_row(
            row.variant,
            row.doors,
            _interval(row.ate_mm, row.ate_digits, "-"),
            _number(row.heading_deg.value, 1),
            _number(row.f1.value, 2),
            _number(row.brier.value, 2),
            _number(row.failed_percent.value, 0, "%"),
            _number(row.ms.value, 2),
            end_section=row.doors == "moving",
        )
    return table


def _interval(interval: Interval, digits: int, to: str = " to ") -> str:
    if math.isnan(interval.value):
        return "-"
    value, low, high = (_number(number, digits) for number in interval)
    return f"{value} ({low}{to}{high})"


def _number(value: float, digits: int, unit: str = "") -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}f}{unit}"
