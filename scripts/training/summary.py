"""Summary of an evaluation as tables in the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.box import HORIZONTALS
from rich.console import Console
from rich.table import Table

from slam.benchmark.results import Result

from ..report.scores import DOORS, F1_OVER_TIME, QUALITY, REGRET, Score, present
from ..report.summary import Summary

MAIN_SCORES = (DOORS, REGRET, F1_OVER_TIME)
COLUMNS = 2  # of the main scores, each with its interval, beside the agent in 80 characters
COMPARED = (DOORS, REGRET)  # scores whose differences from the first agent are told


def print_summary(rows: Sequence[Result], order: Sequence[str]) -> None:
    """Print medians for each condition, the main scores with intervals and the others in a second
    table, and the differences from the first agent on the same episodes."""
    summary = Summary(rows, order)
    main = present(MAIN_SCORES, rows)[:COLUMNS]
    others = [score for score in present(QUALITY, rows) if score not in main]
    for condition in summary.conditions:
        groups = list(summary.of(condition))
        table = _table(str(condition), main)
        for group in groups:
            table.add_row(group.variant, *[_interval(one, *group.median(one)) for one in main])
        Console().print(table)
        table = _table("medians of other scores", others)
        for group in groups:
            cells = [score.format(group.median(score).value) for score in others]
            table.add_row(group.variant, *cells)
        Console().print(table)
    for one in summary.comparisons():
        if one.score in COMPARED:
            low, high = one.found.difference[1:]
            print(
                f"{one.condition}: {one.variant} minus {one.baseline}, {one.score.name}: "
                f"{one.found.difference.value:+.3f} ({low:+.3f} to {high:+.3f}), q = {one.q:.3f}"
            )


def _table(title: str, scores: Sequence[Score]) -> Table:
    """An empty table with a column for each score."""
    table = Table(box=HORIZONTALS, title=title, padding=(0, 1, 0, 0))
    table.add_column("agent", overflow="fold")
    for score in scores:
        table.add_column(score.heading, justify="right", overflow="fold")
    return table


def _interval(score: Score, value: float, low: float, high: float) -> str:
    return f"{score.format(value)} ({score.format(low)} to {score.format(high)})"
