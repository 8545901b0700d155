"""What was wrong with a file that could still be used, counted."""

from __future__ import annotations

from typing import NamedTuple

from slam.io.one_line import one_line

MOST = 50  # kinds that are told apart: a file that is all trouble names frames and topics in each


class RecordingWarning(NamedTuple):
    """One kind of trouble: how often it came up, and the first of them (numbers from 1)."""

    kind: str
    times: int
    line: int
    unit: str = "line"

    def __str__(self) -> str:
        often = "once," if self.times == 1 else f"{self.times} times, first"
        return f"{self.kind}: {often} on {self.unit} {self.line}"


class WarningCounter:
    """Counts kinds of trouble in the order in which they first came up; `unit` is what a file
    is numbered by."""

    def __init__(self, unit: str = "line") -> None:
        self._unit = unit
        self._found: dict[str, RecordingWarning] = {}

    def add(self, kind: str, line: int) -> None:
        """Count one line with a kind of trouble."""
        kind = one_line(kind)
        if len(self._found) >= MOST and kind not in self._found:
            kind = "other trouble"
        known = self._found.get(kind, RecordingWarning(kind, 0, line, self._unit))
        self._found[kind] = known._replace(times=known.times + 1, line=min(known.line, line))

    def counted(self) -> tuple[RecordingWarning, ...]:
        """All of them."""
        return tuple(self._found.values())
