"""The tables of the suite `weeks`: scores of each map model, compared with the first one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.benchmark.results import Result
from slam.benchmark.statistics import adjusted, median, paired

SIGNIFICANT = 0.05


class Column(NamedTuple):
    """A score.

    name    in the results
    title   of the column
    scale   by which it is shown
    digits  after the point
    """

    name: str
    title: str
    scale: float = 1.0
    digits: int = 2


PLACED = (
    Column("right", "rightly, %", 100.0, 1),
    Column("wrong", "wrongly, %", 100.0, 1),
    Column("unplaced", "not at all, %", 100.0, 1),
)
SCORES = (
    Column("off", "scans off, %", 100.0, 2),
    Column("ate", "ATE, mm", 1e3, 1),
    Column("f1", "F1", 1.0, 3),
    Column("brier", "Brier", 1.0, 4),
    Column("ghosts", "ghosts/m", 1.0, 2),
)
COSTS = (Column("map_bytes", "map, MB", 1e-6, 1), Column("seconds", "time, s", 1.0, 0))
WAYS = ("frozen", "living")


class WeeksTable(NamedTuple):
    """The scores of one world, of the frozen or of the living map.

    title     the world and the number of campaigns
    headings  of the columns
    rows      of text, one a variant
    """

    title: str
    headings: list[str]
    rows: list[list[str]]


def weeks_tables(rows: Sequence[Result], variants: Sequence[str]) -> list[WeeksTable]:
    """Of each world, for the frozen and the living map: the share of visits placed (mean) and the
    scores (median over campaigns). Campaigns count that all variants have finished. * differs from
    the first variant by Wilcoxon's signed rank test, at 5 % of false discoveries among all
    comparisons of a world."""
    worlds = dict.fromkeys(row["world"] for row in rows)
    return [table for world in worlds for table in _of_world(world, rows, variants)]


def markdown(tables: Sequence[WeeksTable]) -> str:
    """The tables as text."""
    parts = []
    for table in tables:
        lines = [f"{table.title}\n"]
        if table.rows:
            lines += [_line(table.headings), "|---" * len(table.headings) + "|"]
            lines += [_line([f"`{name}`", *cells]) for name, *cells in table.rows]
        parts.append("\n".join([*lines, ""]))
    return "\n".join(parts)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _of_world(world: str, rows: Sequence[Result], variants: Sequence[str]) -> list[WeeksTable]:
    found = {
        (row["variant"], row["seed"]): row
        for row in rows
        if row["world"] == world and row["error"] is None
    }
    seeds = sorted({seed for _, seed in found})
    seeds = [seed for seed in seeds if all((name, seed) in found for name in variants)]
    if not seeds:
        return [WeeksTable(f"{world}: no campaign was finished by all variants", [], [])]
    marks = _marks(found, variants, seeds)
    campaigns = f"{len(seeds)} campaign{'s' * (len(seeds) > 1)}"
    return [
        WeeksTable(f"{world}, {way} map: {campaigns}", *_of_way(way, found, variants, seeds, marks))
        for way in WAYS
    ]


def _of_way(
    way: str,
    found: dict[tuple[str, int], Result],
    variants: Sequence[str],
    seeds: Sequence[int],
    marks: set[tuple[str, str]],
) -> tuple[list[str], list[list[str]]]:
    """Headings and rows."""
    columns = [*PLACED, *SCORES, *(COSTS if way == "living" else ())]
    rows = []
    for variant in variants:
        cells = [variant]
        for column in columns:
            name = column.name if column in COSTS else f"{way}_{column.name}"
            values = _values(found, variant, seeds, name)
            value = np.mean(values) if column in PLACED else median(values).value
            mark = "*" if (variant, name) in marks else ""
            cells.append(f"{column.scale * value:.{column.digits}f}{mark}")
        rows.append(cells)
    return [way, *(column.title for column in columns)], rows


def _values(
    found: dict[tuple[str, int], Result], variant: str, seeds: Sequence[int], name: str
) -> list[float]:
    """One value a campaign; infinite where there is none, as the ATE of a robot never placed."""
    values = [found[variant, seed][name] for seed in seeds]
    return [np.inf if value is None else float(value) for value in values]


def _marks(
    found: dict[tuple[str, int], Result], variants: Sequence[str], seeds: Sequence[int]
) -> set[tuple[str, str]]:
    """(variant, score) that differ from the first variant."""
    names = [f"{way}_{column.name}" for way in WAYS for column in (*PLACED, *SCORES)]
    pairs = [(variant, name) for variant in variants[1:] for name in names]
    ps = [
        paired(_values(found, variant, seeds, name), _values(found, variants[0], seeds, name)).p
        for variant, name in pairs
    ]
    return {pair for pair, p in zip(pairs, adjusted(ps), strict=True) if p < SIGNIFICANT}
