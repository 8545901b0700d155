"""Warnings about a file that could be read in part, counted by kind."""

from __future__ import annotations

from typing import NamedTuple

from slam.io.one_line import one_line

MAX_KINDS = 50  # counted separately: in a damaged file each message can have another frame


class RecordingWarning(NamedTuple):
    """One kind of warning: how many times, and the first of its lines (numbers from 1)."""

    kind: str
    times: int
    line: int
    unit: str = "line"

    def __str__(self) -> str:
        often = "once," if self.times == 1 else f"{self.times} times, first"
        return f"{self.kind}: {often} on {self.unit} {self.line}"


class WarningCounter:
    """Counts warnings by kind, in the order of their first occurrence; `unit` is what the numbers
    count, such as lines."""

    def __init__(self, unit: str = "line") -> None:
        self._unit = unit
        self._found: dict[str, RecordingWarning] = {}

    def add(self, kind: str, line: int) -> None:
        """Count a warning about a line."""
        kind = one_line(kind)
        if len(self._found) >= MAX_KINDS and kind not in self._found:
            kind = "other trouble"
        known = self._found.get(kind, RecordingWarning(kind, 0, line, self._unit))
        self._found[kind] = known._replace(times=known.times + 1, line=min(known.line, line))

    def counted(self) -> tuple[RecordingWarning, ...]:
        """All warnings."""
        return tuple(self._found.values())
