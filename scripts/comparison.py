"""Static against dynamic maps, episode by episode: what the paper claims, measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from slam.benchmark.statistics import Paired, paired

Result = dict[str, Any]


class Score(NamedTuple):
    """A score as it is told: its name in the results, its name for people, its unit."""

    key: str
    name: str
    scale: float
    unit: str
    digits: int


SCORES = (
    Score("ate", "ATE", 1e3, " mm", 1),
    Score("f1_5cm", "F1", 1.0, "", 3),
    Score("brier_share_door", "Brier of doors", 1.0, "", 3),
)


def comparison(results: Sequence[Result], first: str, second: str) -> list[str]:
    """`first` minus `second` with moving doors, one line a score; none where one is missing."""
    lines = []
    for score in SCORES:
        a, b = (_series(results, variant, score) for variant in (first, second))
        shared = sorted(a.keys() & b.keys())
        if shared:
            found = paired([a[seed] for seed in shared], [b[seed] for seed in shared])
            lines.append(_line(score, found))
    return lines


def _series(results: Sequence[Result], variant: str, score: Score) -> dict[int, float]:
    return {
        row["seed"]: score.scale * row[score.key]
        for row in results
        if (row["variant"], row["doors"]) == (variant, "moving") and row[score.key] is not None
    }


def _line(score: Score, found: Paired) -> str:
    value, low, high = (f"{number:+.{score.digits}f}" for number in found.difference)
    p = "p < 0.001" if found.p < 0.001 else f"p = {found.p:.3f}"
    return f"{score.name} {value}{score.unit} ({low} to {high}), {p}"
