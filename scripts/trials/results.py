"""Rows of results: the condition of a run, and reading results.jsonl."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from slam.benchmark.results import Result, read
from slam.errors import InputError

REQUIRED = ("run", "suite", "condition", "variant", "seed", "episode", "error", "versions",
            "commit", "host")  # fmt: skip
"""Keys of every row; `condition` names further ones."""


class Condition(NamedTuple):
    """The condition of a group of runs: its factors by name."""

    factors: tuple[tuple[str, str | float], ...]

    @staticmethod
    def of(row: Result) -> Condition:
        """The condition of a run."""
        return Condition.named({name: row[name] for name in row["condition"]})

    @staticmethod
    def named(factors: Mapping[str, str | float]) -> Condition:
        """The condition with these factors."""
        return Condition(tuple(factors.items()))

    def __str__(self) -> str:
        return ", ".join(f"{name} {value}" for name, value in self.factors)


def read_rows(path: Path) -> list[Result]:
    """The runs in a results.jsonl. Raises InputError if it cannot be read or holds other data."""
    rows = read(path)
    try:
        for row in rows:
            for name in (*REQUIRED, *row["condition"]):
                row[name]
    except (KeyError, TypeError) as error:
        raise InputError(f"{path}: not the results of a bench ({error!r})") from None
    return rows
