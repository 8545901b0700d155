"""`python -m docs.making.patrol_scores out/evaluate`: the table of docs/splits.md on patrols.

Reads what `dynslam evaluate` wrote; only episodes that every agent has finished are counted.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from slam.benchmark.statistics import median

COLUMNS = {"reward": ("return", 1.0, ".1f"), "door_brier": ("Brier of doors", 1.0, ".3f"),
           "regret_s": ("regret, s", 1.0, ".2f"),  # of DoorPatrol-v1 only
           "coverage": ("seen", 100.0, ".0f"), "contact": ("contact, s", 1.0, ".1f"),
           "ate": ("ATE, mm", 1000.0, ".0f")}  # fmt: skip


def table(folder: Path) -> Iterator[str]:
    """The rows, in Markdown: medians with bootstrap 95 % intervals."""
    lines = (folder / "results.jsonl").read_text(encoding="utf-8").splitlines()
    by_agent: dict[str, dict[int, Any]] = {}
    for row in map(json.loads, lines):
        if row["error"] is None:
            by_agent.setdefault(row["variant"], {})[row["seed"]] = row
    shared = sorted(set.intersection(*(set(rows) for rows in by_agent.values())))
    yield f"Test episodes {shared[0]} to {shared[-1]}, {len(shared)} of them:\n"
    scored = {key for rows in by_agent.values() for i in shared for key in rows[i]}
    columns = {key: column for key, column in COLUMNS.items() if key in scored}
    yield "| agent | " + " | ".join(name for name, _, _ in columns.values()) + " |"
    yield "|---" * (1 + len(columns)) + "|"
    for agent, rows in by_agent.items():
        cells = [_cell([rows[i][key] for i in shared], *columns[key][1:]) for key in columns]
        yield f"| {agent} | " + " | ".join(cells) + " |"


def _cell(values: list[float], scale: float, form: str) -> str:
    value, low, high = (format(scale * number, form) for number in median(values))
    return f"{value} ({low} to {high})"


if __name__ == "__main__":
    print("\n".join(table(Path(sys.argv[1]))))
