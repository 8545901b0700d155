"""The table of an experiment: variant x {static, moving doors}, each figure with its interval."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from rich.table import Table

from slam.benchmark.statistics import Interval, median, share

Result = dict[str, Any]
HEADINGS = (
    "variant",
    "doors",
    "ATE, mm (95 %)",
    "largest heading error, deg",
    "F1 at 5 cm",
    "failed",
    "ms a match",
)


def rows(results: Sequence[Result]) -> list[tuple[str, ...]]:
    """One row a variant and door law, in the order in which they first came up."""
    groups: dict[tuple[str, str], list[Result]] = {}
    for result in results:
        groups.setdefault((result["variant"], result["doors"]), []).append(result)
    order = list(dict.fromkeys(variant for variant, _ in groups))
    keys = sorted(groups, key=lambda key: order.index(key[0]))
    return [(variant, doors, *_cells(groups[variant, doors])) for variant, doors in keys]


def _cells(group: Sequence[Result]) -> tuple[str, ...]:
    def of(name: str) -> Interval:
        return median([math.nan if row[name] is None else row[name] for row in group])

    failed = share([row["failed"] for row in group])
    return (
        _interval(of("ate"), lambda metres: f"{1e3 * metres:.0f}"),
        _interval(of("heading_max"), lambda radians: f"{math.degrees(radians):.1f}"),
        _interval(of("f1_5cm"), lambda value: f"{value:.2f}"),
        f"{sum(row['failed'] for row in group)}/{len(group)} (< {100 * failed.high:.0f} %)",
        f"{of('ms_per_matched_scan').value:.2f}",
    )


def _interval(interval: Interval, text: Callable[[float], str]) -> str:
    value, low, high = (text(number) for number in interval)
    return f"{value} ({low} to {high})"


def markdown(results: Sequence[Result]) -> str:
    """The table for a README."""
    lines = [HEADINGS, ("---",) * len(HEADINGS), *rows(results)]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def terminal(results: Sequence[Result], title: str) -> Table:
    """The table for a terminal."""
    table = Table(title=title, title_justify="left")
    for heading in HEADINGS:
        table.add_column(heading)
    for cells in rows(results):
        table.add_row(*cells, end_section=cells[1] == "moving")
    return table
