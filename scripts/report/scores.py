"""Scores: keys in the results, names for people, units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from slam.benchmark.results import Result


class Score(NamedTuple):
    """One score.

    key     in the results
    name    for people
    scale   factor from the results to the unit
    unit    after a space, or empty
    digits  decimals
    better  -1: less is better; 1: more is better
    worst   value of a failed run
    """

    key: str
    name: str
    scale: float = 1.0
    unit: str = ""
    digits: int = 1
    better: int = -1
    worst: float = math.inf

    def of(self, row: Result) -> float | None:
        """Value of a run in the unit; None if the row has none."""
        if row.get("error") is not None:
            return self.worst
        value = row.get(self.key)
        return self.scale * value if isinstance(value, int | float) else None

    def format(self, value: float) -> str:
        """The number, without its unit."""
        if math.isnan(value):
            return "-"
        return f"{value:.{self.digits}f}" if math.isfinite(value) else "lost"

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name}, {self.unit.strip()}" if self.unit else self.name


ATE = Score("ate", "ATE", 1e3, " mm")
F1 = Score("f1_5cm", "F1", digits=3, better=1, worst=0.0)
BRIER = Score("brier_share_door", "Brier of doors", digits=3, worst=1.0)
HEADING = Score("heading_max", "largest heading error", math.degrees(1.0), " deg", 2)
TIME = Score("ms_per_matched_scan", "time per matched scan", 1.0, " ms", 2)
RELATIONS = Score("translation_mean", "error of relations", 1e3, " mm")
ALIGNED = Score("ate_aligned", "ATE, aligned", 1e3, " mm")
AGREEMENT = Score("agreement", "agreement of the walls", 100.0, " %", 1, 1, 0.0)
DOORS = Score("door_brier", "Brier of doors over time", digits=3, worst=1.0)
REGRET = Score("regret_s", "regret of questions", 1.0, " s", 2)
F1_OVER_TIME = Score("f1_over_time", "F1 over time", digits=3, better=1, worst=0.0)
MAIN_SCORES = (DOORS, ATE, RELATIONS, ALIGNED, AGREEMENT)
"""Runs are compared by the first of these that the results have."""

QUALITY = (
    DOORS,
    REGRET,
    F1_OVER_TIME,
    ATE,
    Score("ate_online", "ATE, online", 1e3, " mm"),
    ALIGNED,
    HEADING,
    RELATIONS,
    Score("clear_translation_mean", "error of clear relations", 1e3, " mm"),
    Score("translation_mean_online", "error of relations, online", 1e3, " mm"),
    Score("rotation_mean_deg", "heading error of relations", 1.0, " deg", 2),
    AGREEMENT,
    F1,
    Score("adnn_map_to_truth", "map to truth", 1e3, " mm"),
    BRIER,
    Score("slam_brier", "Brier of the SLAM's doors now", digits=3),
    Score("coverage", "coverage", 100.0, " %", 1, 1, 0.0),
    Score("path_length", "path length", 1.0, " m"),
    Score("contact", "in contact", 1.0, " s"),
    Score("reward", "reward", digits=1, better=1, worst=-math.inf),
)
MEMORY = Score("memory_mb", "memory", 1.0, " MB", 1)
THINKING = Score("ms_per_step", "agent's time per step", 1.0, " ms", 2)
COST = (THINKING, TIME, MEMORY)
FOREMOST = (F1_OVER_TIME, F1, BRIER, THINKING, TIME)
"""Shown next to the main one."""


def present(scores: Sequence[Score], rows: Sequence[Result]) -> list[Score]:
    """The scores that any row has."""
    return [score for score in scores if any(row.get(score.key) is not None for row in rows)]


def main_score(rows: Sequence[Result]) -> Score | None:
    """The score that runs are compared by; None without truth or reference."""
    return next(iter(present(MAIN_SCORES, rows)), None)


def format_p(p: float) -> str:
    """A p-value in the style of papers."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"
