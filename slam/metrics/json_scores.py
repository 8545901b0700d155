"""Scores as a flat dict of JSON values."""

from __future__ import annotations

import math

Number = float | int | bool


def json_scores(names_and_values: dict[str, Number], suffix: str = "") -> dict[str, Number | None]:
    """The dict with `suffix` after every name; NaN and infinity, which JSON lacks, become None."""
    return {
        name + suffix: value if math.isfinite(value) else None
        for name, value in names_and_values.items()
    }
