"""`dynslam compare A.jsonl B.jsonl`: what changed between two benches; a gate for regressions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass
class CompareCommand:
    """Compare two benches of the same suite, before and after a change of the code.

    Runs are paired by condition, variant and seed. The exit status is 1 if a score is significantly
    worse, by more than the tolerance, or if runs failed that did not fail before.
    """

    before: tyro.conf.Positional[Path]
    """results.jsonl of one bench, or its directory."""
    after: tyro.conf.Positional[Path]
    """results.jsonl of the other bench, or its directory."""
    tolerance: float = 0.02
    """Relative change of a median that counts as equal."""
    time: bool = False
    """Compare time and memory too: only if both benches ran on the same quiet machine."""
    every: bool = False
    """Print unchanged scores as well."""

    def __call__(self) -> int:
        """Compare, print."""
        from .changes import compare_benches

        return compare_benches(self)
