"""Summary of an evaluation as tables in the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.box import HORIZONTALS
from rich.console import Console
from rich.table import Table

from slam.benchmark.results import Result

from ..report.scores import DOORS, F1_OVER_TIME, QUALITY, Score, present
from ..report.summary import Summary

MAIN_SCORES = (DOORS, F1_OVER_TIME)


def print_summary(rows: Sequence[Result], order: Sequence[str]) -> None:
    """Print medians for each condition, with intervals of the main scores, and the differences from
    the first agent on the same episodes."""
    summary = Summary(rows, order)
    others = [score for score in present(QUALITY, rows) if score not in MAIN_SCORES]
    for condition in summary.conditions:
        table = Table(box=HORIZONTALS, title=str(condition), padding=(0, 1, 0, 0))
        table.add_column("agent", overflow="fold")
        for score in (*MAIN_SCORES, *others):
            table.add_column(score.heading, justify="right", overflow="fold")
        for group in summary.of(condition):
            cells = [_interval(score, *group.median(score)) for score in MAIN_SCORES]
            cells += [score.told(group.median(score).value) for score in others]
            table.add_row(group.variant, *cells)
        Console().print(table)
    for one in summary.comparisons():
        if one.score == DOORS:
            low, high = one.found.difference[1:]
            print(
                f"{one.condition}: {one.variant} minus {one.baseline}, {one.score.name}: "
                f"{one.found.difference.value:+.3f} ({low:+.3f} to {high:+.3f}), q = {one.q:.3f}"
            )


def _interval(score: Score, value: float, low: float, high: float) -> str:
    return f"{score.told(value)} ({score.told(low)} to {score.told(high)})"
