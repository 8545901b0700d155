"""`python -m docs.making.paired_scores out/evaluate ...`: agents against `greedy` on its episodes.

Reads what `dynslam evaluate` wrote into folders. Of each agent, and of all together, prints by how
much its Brier score of the doors and its regret are less than those of `greedy`, with 95 % t
intervals over episodes; of all together also with the interval over agents (training seeds).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from docs.making.fast_scores import interval
from slam.benchmark.results import read
from slam.geometry import Array

BASELINE = "greedy"
SCORES = {"door_brier": ("Brier", ".3f"), "regret_s": ("regret, s", ".2f")}


def table(folders: list[Path]) -> Iterator[str]:
    """The rows, in Markdown."""
    driven = {agent: rows for folder in folders for agent, rows in pairs(folder).items()}
    yield "| agent | episodes | " + " | ".join(
        f"{name} | `{BASELINE}` | less by" for name, _ in SCORES.values()
    ) + " |"  # fmt: skip
    yield "|---" * (2 + 3 * len(SCORES)) + "|"
    for agent, rows in driven.items():
        yield _row(agent, np.array([*rows.values()]))
    episodes = sorted({i for rows in driven.values() for i in rows})
    yield _row("all, over episodes", np.array([
        np.mean([rows[i] for rows in driven.values() if i in rows], axis=0) for i in episodes
    ]))  # fmt: skip
    if len(driven) > 1:
        means = np.array([np.mean([*rows.values()], axis=0) for rows in driven.values()])
        yield _row("all, over agents", means)


def pairs(folder: Path) -> dict[str, dict[int, Array]]:
    """Of each agent but `greedy`, by episode, (2, SCORES): its scores and those of `greedy`."""
    found: dict[str, dict[int, list[float]]] = {}
    for row in read(folder / "results.jsonl"):
        if row["error"] is None:
            scores = [float(row[key]) for key in SCORES]
            found.setdefault(row["variant"], {})[row["seed"]] = scores
    usual = found.pop(BASELINE)
    return {
        agent: {i: np.array([rows[i], usual[i]]) for i in sorted(rows) if i in usual}
        for agent, rows in found.items()
    }


def _row(name: str, scores: Array) -> str:
    """A row of scores (n, 2, SCORES), of an agent and of `greedy`."""
    cells = [name, str(len(scores))]
    for k, (_, form) in enumerate(SCORES.values()):
        own, usual = scores[..., k].T
        less = (usual - own).mean(), *interval(usual - own)
        mean, low, high = (format(value, form) for value in less)
        cells += [format(own.mean(), form), format(usual.mean(), form), f"{mean} ({low} to {high})"]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    print("\n".join(table([Path(folder) for folder in sys.argv[1:]])))
