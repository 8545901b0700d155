"""Rows of results: the condition of a run, and reading results.jsonl."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import UnionType
from typing import NamedTuple

from slam.benchmark.results import Result, read
from slam.errors import InputError
from slam.io.one_line import one_line

REQUIRED: dict[str, type | UnionType] = {
    "run": str, "suite": str, "condition": list, "variant": str, "seed": int, "episode": str,
    "error": str | None, "versions": dict, "commit": str | None, "host": dict,
}  # fmt: skip
"""Keys of every row and what they hold; `condition` names further ones."""


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
    for row in rows:
        wrong = [name for name, kind in REQUIRED.items() if not _is(row.get(name, ...), kind)]
        wrong = wrong or [name for name in row["condition"] if not _is_factor(row, name)]
        if wrong:
            raise InputError(f"{path}: not the results of a bench (no {one_line(wrong[0], 60)})")
    return _once(rows, path)


def _is(value: object, kind: type | UnionType) -> bool:
    return isinstance(value, kind) and not isinstance(value, bool)


def _is_factor(row: Result, name: object) -> bool:
    return isinstance(name, str) and _is(row.get(name), str | int | float)


def _once(rows: list[Result], path: Path) -> list[Result]:
    """The rows, of runs that are in the file several times the last one; says how many are: of two
    benches in one folder, intervals must not count a run twice."""
    last: dict[str, Result] = {}
    doubled = 0
    for row in rows:
        before = last.get(row["run"])
        doubled += before is not None and before["error"] is None  # a failed run is tried again
        last[row["run"]] = row
    if doubled:
        _tell_doubled(path, doubled)
    return list(last.values())


@cache
def _tell_doubled(path: Path, count: int) -> None:
    print(f"{path}: warning: {count} runs are in it again; the last one counts", file=sys.stderr)
