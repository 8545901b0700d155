"""doors-week.png: the week of each door that was seen on several days."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from slam.layers.doors import MappedDoor

from ..console.output import write_png
from ..figures.style import SMALL, blank_figure
from ..figures.week_figure import draw_hours

PICTURE = "doors-week.png"
MAX_DOORS = 12  # that are drawn
MIN_DAYS = 2  # of the week, on which a door was seen


def write_weeks(
    doors: Sequence[MappedDoor], weeks: Sequence[dict[str, Any] | None], folder: Path
) -> list[str]:
    """Write the picture of the first doors, numbered as in doors.geojson; returns its name. Without
    a door that was seen on MIN_DAYS of the week there is none."""
    drawn = [(k, week) for k, week in enumerate(weeks) if week and _days(week) >= MIN_DAYS]
    (folder / PICTURE).unlink(missing_ok=True)  # of an earlier run
    if not drawn:
        return []
    drawn = drawn[:MAX_DOORS]
    figure = blank_figure(6.0, 0.5 + 1.5 * len(drawn))
    axes = figure.subplots(len(drawn), 1, squeeze=False).ravel().tolist()
    for axis, (k, week) in zip(axes, drawn, strict=True):
        x, y = doors[k].ends.mean(axis=0)
        draw_hours(axis, week, f"P(open) of door {k + 1} at ({x:.1f}, {y:.1f})")
    axes[-1].set_xlabel(f"hour ({drawn[0][1]['timezone']}); grey: never seen", fontsize=SMALL)
    write_png(figure, folder / PICTURE)
    return [PICTURE]


def _days(week: dict[str, Any]) -> int:
    return int((np.array(week["watched_hours"]) > 0).any(axis=1).sum())
