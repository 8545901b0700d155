"""What was wrong with a file that could still be used, counted."""

from __future__ import annotations

from typing import NamedTuple


class Warned(NamedTuple):
    """One kind of trouble: how often it came up, and the first of them (line numbers from 1)."""

    kind: str
    times: int
    line: int

    def __str__(self) -> str:
        often = "once," if self.times == 1 else f"{self.times} times, first"
        return f"{self.kind}: {often} on line {self.line}"


class Warnings:
    """Counts kinds of trouble in the order in which they first came up."""

    def __init__(self) -> None:
        self._found: dict[str, Warned] = {}

    def add(self, kind: str, line: int) -> None:
        """Count one line with a kind of trouble."""
        known = self._found.get(kind, Warned(kind, 0, line))
        self._found[kind] = known._replace(times=known.times + 1, line=min(known.line, line))

    def counted(self) -> tuple[Warned, ...]:
        """All of them."""
        return tuple(self._found.values())
