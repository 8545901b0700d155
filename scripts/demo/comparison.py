"""Static against dynamic maps on the same episodes: measurements for the paper's claims."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from slam.benchmark.results import Result
from slam.benchmark.statistics import Paired, median, paired

from ..report.scores import ATE, BRIER, F1, Score, format_p
from ..report.summary import MIN_PAIRS

MAPS = ("static", "dynamic")


SCORES = (ATE, F1, BRIER)


class VariantCase(NamedTuple):
    """A variant under a door law."""

    variant: str
    doors: str


def findings(results: Sequence[Result]) -> str:
    """Paired differences behind the paper's claims, for both weights of the beams, as plain text;
    empty without results."""
    blocks = []
    for tail in ("", "/beta1"):
        static, dynamic = (VariantCase(f"{kind}-ml{tail}", "moving") for kind in MAPS)
        for a, b, scores in (
            (static, dynamic, SCORES),
            (static, static._replace(doors="static"), SCORES[:1]),
        ):
            lines = comparison(results, a, b, scores)
            if lines:
                title = f"{a.variant}, {a.doors} doors, minus {b.variant}, {b.doors} doors:"
                blocks.append("\n".join([title, *(f"  {line}" for line in lines)]))
    lines = [f"  {line}" for line in times_the_bound(results)]
    if lines:
        blocks.append("\n".join(["ATE, in Cramer-Rao bounds of one scan in the true map:", *lines]))
    return "\n".join(blocks)


def times_the_bound(results: Sequence[Result]) -> list[str]:
    """The ATE over the bound of its episode, one line per map and door law.

    The bound is of localization in a known map; a SLAM need not reach it.
    """
    lines = []
    for case in (VariantCase(f"{m}-ml", doors) for m in MAPS for doors in ("static", "moving")):
        ratios = [
            row["ate"] / row["ate_bound"]
            for row in results
            if (row["variant"], row["doors"]) == case and row.get("ate_bound")
        ]
        if ratios:
            times, low, high = median(ratios)
            lines.append(
                f"{case.variant}, {case.doors} doors: {times:.1f} ({low:.1f} to {high:.1f})"
            )
    return lines


def comparison(
    results: Sequence[Result], a: VariantCase, b: VariantCase, scores: Sequence[Score] = SCORES
) -> list[str]:
    """`a` minus `b`, paired by seed, one line per score that both have."""
    lines = []
    for score in scores:
        first, second = _series(results, a, score), _series(results, b, score)
        shared = sorted(first.keys() & second.keys())
        if shared:
            found = paired([first[seed] for seed in shared], [second[seed] for seed in shared])
            lines.append(_line(score, found, len(shared)))
    return lines


def _series(results: Sequence[Result], case: VariantCase, score: Score) -> dict[int, float]:
    return {
        row["seed"]: value
        for row in results
        if (row["variant"], row["doors"]) == case and (value := score.of(row)) is not None
    }


def _line(score: Score, found: Paired, pairs: int) -> str:
    value, low, high = (f"{number:+.{score.digits}f}" for number in found.difference)
    if pairs < MIN_PAIRS:
        return f"{score.name} {value}{score.unit} ({pairs} pairs, too few to judge)"
    return f"{score.name} {value}{score.unit} ({low} to {high}), {format_p(found.p)}"
