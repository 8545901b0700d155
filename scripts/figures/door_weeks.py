"""The week of each door of a building: the truth, and beside it what was learned of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from slam.geometry import Array
from slam.io.door_memory import RememberedDoor

from .style import blank_figure
from .week_figure import draw_hours

NEAR = 0.5  # m from the middle of a true door to that of one that was found
WIDTH, HEIGHT = 10.0, 1.5  # inches, of a door


def learned_week(doors: Sequence[RememberedDoor], middle: Array) -> dict[str, Any] | None:
    """The week of the door that is remembered at a place (2,), m; None if there is none, or none of
    its looks has a date."""
    near = [one for one in doors if np.hypot(*(one.door.ends.mean(axis=0) - middle)) < NEAR]
    return near[0].forecast.to_dict() if near and near[0].forecast.look is not None else None


def door_weeks(truths: Sequence[Array], weeks: Sequence[dict[str, Any] | None]) -> Figure:
    """Each door in a row.

    truths  (7, 24) each: share of the time in which the door was open, by weekday and hour
    weeks   what was learned of it, as `DoorForecast.to_dict` has it; None: it is not remembered
    """
    figure = blank_figure(WIDTH, HEIGHT * len(truths))
    axes = figure.subplots(len(truths), 2, squeeze=False)
    for k, (truth, week) in enumerate(zip(truths, weeks, strict=True)):
        draw_hours(axes[k, 0], truth, f"door {k + 1}: share of the time open, truth")
        draw_hours(axes[k, 1], week, _compared(week, truth))
    return figure


def _compared(week: dict[str, Any] | None, truth: Array) -> str:
    if week is None:
        return "not remembered"
    seen = np.array(week["watched_hours"]) > 0
    off = np.nanmean(np.abs(np.array(week["rate"]) - truth)[seen])
    return f"P(open), learned; off by {off:.2f} in the {seen.sum()} hours that were seen"
