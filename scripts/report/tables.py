"""Tables of a bench, for the page and as Markdown and LaTeX."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from slam.benchmark.statistics import Interval

from .scores import COST, FOREMOST, QUALITY, Score, present
from .summary import Summary

LATEX_ESCAPES = {character: f"\\{character}" for character in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
}
"""Characters with a meaning in LaTeX, or another glyph in its default font."""


class Cell(NamedTuple):
    """A cell of a table.

    text   shown
    value  sort key; None sorts last
    mark   `better`, `worse` or empty
    """

    text: str
    value: float | str | None
    mark: str = ""


class Table(NamedTuple):
    """A table.

    name      of its files
    title     above it
    caption   below it
    headings  of the columns
    rows      cells, one per heading
    """

    name: str
    title: str
    caption: str
    headings: list[str]
    rows: list[list[Cell]]


def tables(summary: Summary) -> list[Table]:
    """The tables that the results allow."""
    return [
        table for table in (_medians(summary), _paired(summary), _errors(summary)) if table.rows
    ]


def _medians(summary: Summary) -> Table:
    scores = _main_first(present([*QUALITY, *COST], summary.rows), summary.main)
    headings = ["condition", summary.wording.compared, "runs", "lost, %"]
    headings += [score.heading for score in scores]
    if summary.main:
        headings.append(f"{summary.main.name}, IQM")
    rows = []
    for condition in summary.conditions:
        for group in summary.of(condition):
            failed = group.failed()
            row = [_word(str(condition)), _word(group.variant), _count(len(group.rows)),
                   _interval(failed, Score("", "", digits=0))]  # fmt: skip
            row += [_interval(group.median(score), score) for score in scores]
            if summary.main:
                row.append(_interval(group.interquartile_mean(summary.main), summary.main))
            rows.append(row)
    caption = (
        "Medians, and the interquartile mean (IQM), with bootstrap 95 % intervals; lost: ATE above "
        "0.3 m, or no result, with Wilson's interval. A run without a result counts as infinitely "
        "bad."
    )
    return Table("summary", "Summary", caption, headings, rows)


def _main_first(scores: Sequence[Score], main: Score | None) -> list[Score]:
    """The scores in an order in which a screen of 1,200 pixels shows those that matter most."""
    first = [score for score in (main, *FOREMOST) if score is not None and score in scores]
    return [*first, *(score for score in scores if score not in first)]


def _paired(summary: Summary) -> Table:
    compared = summary.wording.compared
    headings = ["condition", compared, "score", "difference", "p", "q", "pairs", "verdict"]
    rows = []
    for one in summary.comparisons():
        difference = one.score.format
        value, low, high = (_signed(difference(v), v) for v in one.found.difference)
        text = f"{value}{one.score.unit} ({low} to {high})"
        verdict = Cell(one.verdict or "-", one.verdict, one.verdict)
        rows.append(
            [
                _word(str(one.condition)),
                _word(one.variant),
                _word(one.score.name),
                Cell(text, _finite(one.found.difference.value), one.verdict),
                Cell(_p(one.found.p), one.found.p),
                Cell(_p(one.q), one.q),
                _count(one.pairs),
                verdict,
            ]
        )
    baseline = summary.variants[0] if summary.variants else ""
    caption = (
        f"Each {compared} minus {baseline}, episode by episode: median difference "
        f"with its bootstrap 95 % interval, p of Wilcoxon's signed rank test, and q, that p "
        f"corrected for all {len(rows)} comparisons of this table (Benjamini and Hochberg). A "
        f"verdict needs q below 0.05 and six pairs."
    )
    return Table("paired", f"Against {baseline}, paired", caption, headings, rows)


def _errors(summary: Summary) -> Table:
    rows = [
        [_word(row["variant"]), _word(", ".join(f"{n} {row[n]}" for n in row["condition"])),
         Cell(str(row["seed"]), float(row["seed"])), _word(row["error"])]
        for row in summary.rows
        if row.get("error") is not None
    ]  # fmt: skip
    headings = [summary.wording.compared, "condition", "seed", "what happened"]
    return Table("errors", "Runs without a result", "", headings, rows)


def markdown(table: Table) -> str:
    """The table in Markdown."""
    lines = [table.headings, ["---"] * len(table.headings)]
    lines += [[cell.text for cell in row] for row in table.rows]
    return "".join(f"| {' | '.join(map(_marked_down, cells))} |\n" for cells in lines)


def _marked_down(text: str) -> str:
    """Text on one line, without cell ends and tags."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "\\<")


def latex(table: Table) -> str:
    """The table as a tabular with the rules of `booktabs`."""
    lines = [
        f"% {table.caption}",
        f"\\begin{{tabular}}{{{'l' * len(table.headings)}}}",
        "\\toprule",
    ]
    lines.append(_latex_row(table.headings))
    lines.append("\\midrule")
    lines += [_latex_row([cell.text for cell in row]) for row in table.rows]
    return "\n".join([*lines, "\\bottomrule", "\\end{tabular}", ""])


def _latex_row(texts: Sequence[str]) -> str:
    return " & ".join(_escaped(text) for text in texts) + r" \\"


def _escaped(text: str) -> str:
    return "".join(LATEX_ESCAPES.get(character, character) for character in " ".join(text.split()))


def _word(text: str) -> Cell:
    return Cell(text, text)


def _count(number: int) -> Cell:
    return Cell(str(number), float(number))


def _interval(interval: Interval, score: Score) -> Cell:
    value, low, high = interval
    if math.isnan(value):
        return Cell("-", None)
    text = f"{score.format(value)} ({score.format(low)} to {score.format(high)})"
    return Cell(text, _finite(value))


def _finite(value: float) -> float | None:
    """Sort key of a value: JSON and HTML have no infinity, and NaN sorts last."""
    return None if math.isnan(value) else max(min(value, 1e300), -1e300)


def _signed(text: str, value: float) -> str:
    if math.isinf(value):
        return "lost" if value > 0 else "found"
    return f"+{text}" if value > 0 else text


def _p(p: float) -> str:
    return "< 0.001" if p < 0.001 else f"{p:.3f}"
