"""`python -m docs.making.sensor_costs FOLDER`: the table of docs/sensors.md, from a bench.

`FOLDER` is that of `dynslam bench sensors --out FOLDER`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from slam.benchmark.results import read
from slam.benchmark.statistics import median, paired

BARE = "none"  # the condition with which the others are compared
Errors = Mapping[str, Mapping[str, Mapping[int, float]]]  # ATE in m by condition, variant, seed


def errors_of(rows: Sequence[Mapping[str, Any]]) -> Errors:
    """ATE of each run; of a failed one infinite."""
    found: dict[str, dict[str, dict[int, float]]] = {}
    for row in rows:
        ate = math.inf if row["failed"] else row["ate"]
        runs = found.setdefault(row["sensor"], {}).setdefault(row["variant"], {})
        runs[row["seed"]] = ate
    return found


def table(errors: Errors) -> str:
    """Medians, mm, as Markdown: the ATE of the bare laser, and the differences to it."""
    variants = sorted(errors[BARE], reverse=True)  # the static map first
    lines = [f"| | {' | '.join(f'`{v}`' for v in variants)} |", "|---|" + "---|" * len(variants)]
    bare = errors[BARE]
    lines.append(f"| {BARE}: ATE | {' | '.join(_ate(bare[v]) for v in variants)} |")
    for name, found in errors.items():
        if name != BARE:
            cells = [_difference(found[v], bare[v]) for v in variants]
            lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _ate(runs: Mapping[int, float]) -> str:
    value, low, high = (1e3 * number for number in median(list(runs.values())))
    return f"{value:.1f} ({low:.1f} to {high:.1f})"


def _difference(runs: Mapping[int, float], bare: Mapping[int, float]) -> str:
    seeds = sorted(runs.keys() & bare.keys())
    found = paired([runs[s] for s in seeds], [bare[s] for s in seeds])
    value, low, high = (1e3 * number for number in found.difference)
    lost = sum(runs[s] > 0.3 for s in seeds)
    text = f"{value:+.1f} ({low:+.1f} to {high:+.1f})"
    return f"{text}, {lost} of {len(seeds)} lost" if lost else text


if __name__ == "__main__":
    print(table(errors_of(read(Path(sys.argv[1]) / "results.jsonl"))))
