"""The table of agents against `greedy`."""

import json
from pathlib import Path

import pytest

from docs.making.paired_scores import table


def folder(path: Path, rows: list[tuple[str, int, float, float]]) -> Path:
    path.mkdir()
    lines = [
        json.dumps({"variant": agent, "seed": seed, "door_brier": brier, "regret_s": regret,
                    "error": None})
        for agent, seed, brier, regret in rows
    ]  # fmt: skip
    (path / "results.jsonl").write_text("\n".join([*lines, ""]))
    return path


@pytest.fixture
def first(tmp_path: Path) -> Path:
    rows = [("a", 0, 0.1, 1.0), ("greedy", 0, 0.2, 1.5), ("a", 1, 0.1, 1.0)]
    return folder(tmp_path / "first", [*rows, ("greedy", 1, 0.4, 1.5), ("a", 2, 9.0, 9.0)])


def test_an_agent_is_compared_on_the_episodes_of_both(first: Path) -> None:
    _, _, row, _ = table([first])
    assert row == (
        "| a | 2 | 0.100 | 0.300 | 0.200 (-1.071 to 1.471) | 1.00 | 1.50 | 0.50 (0.50 to 0.50) |"
    )


def test_agents_of_other_episodes_are_taken_together(first: Path, tmp_path: Path) -> None:
    rows = [("b", 7, 0.2, 1.0), ("greedy", 7, 0.2, 1.0), ("b", 8, 0.2, 1.0)]
    second = folder(tmp_path / "second", [*rows, ("greedy", 8, 0.2, 1.0)])
    *_, episodes, agents = table([first, second])
    assert episodes.startswith("| all, over episodes | 4 | 0.150 | 0.250 | 0.100 (-0.125 to 0.325)")
    assert agents.startswith("| all, over agents | 2 | 0.150 | 0.250 | 0.100 (-1.171 to 1.371)")
