"""How long a command took, and how much of it went into compiling."""

from __future__ import annotations

import time
from typing import Any

from slam.kernel import COMPILING

LEAST_TOLD = 1.0  # s of compiling


class RunClock:
    """Runs from the begin of a command.

    begun  s, by time.perf_counter
    """

    def __init__(self, begun: float):
        self._begun, self._compiled_before = begun, COMPILING.seconds

    def as_dict(self) -> dict[str, float]:
        """For a summary: s up to now without compiling, and s of compiling."""
        compiling = COMPILING.seconds - self._compiled_before
        return {
            "seconds_in_all": time.perf_counter() - self._begun - compiling,
            "seconds_compiling": compiling,
        }


def in_words(summary: dict[str, Any]) -> str:
    """The times of a summary, for a line on the terminal."""
    words = f"{summary['seconds_in_all']:.1f} s with all files"
    if summary["seconds_compiling"] < LEAST_TOLD:
        return words
    return f"{words}, and {summary['seconds_compiling']:.0f} s of compiling, this once"
