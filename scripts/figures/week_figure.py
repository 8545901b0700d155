"""A door's week as a heat map of hours by weekdays, and how reliable its forecasts are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slam.geometry import Array
from slam.metrics.lost import Reliability, calibration_error

from .style import (
    DYNAMIC,
    ESTIMATE,
    FAINT,
    INK,
    MEDIUM,
    SMALL,
    STATIC,
    TRUTH,
    blank_figure,
    plain_axes,
)

DAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
COLOURS, MARKERS = (TRUTH, ESTIMATE, DYNAMIC, STATIC), "osD^"
COLOUR_MAP = "YlGnBu"
MIN_LOOKS = 50  # in a bin of the diagram that is drawn
DARK = 0.5  # rate above which the numbers are white


class Calibration(NamedTuple):
    """A reliability diagram and what it is of."""

    name: str
    diagram: Reliability


def week_figure(
    week: dict[str, Any], calibrations: Sequence[Calibration] = (), title: str = ""
) -> Figure:
    """The heat map of `DoorForecast.to_dict`; beside it the reliability diagrams, if any."""
    figure = blank_figure(11.5 if calibrations else 8.0, 3.4)
    if not calibrations:
        draw_week(figure.add_subplot(), week, title)
        return figure
    left, right = figure.add_gridspec(1, 2, width_ratios=(2.6, 1.0))
    draw_week(figure.add_subplot(left), week, title)
    _draw_reliability(figure.add_subplot(right), calibrations)
    return figure


def draw_week(axes: Axes, week: dict[str, Any], title: str = "") -> None:
    """Hours (columns) by weekdays (rows): P(state = 1) in percent; hatched where nobody looked."""
    rate, watched = np.array(week["rate"]), np.array(week["watched_hours"])
    mesh = axes.pcolormesh(
        np.arange(25), np.arange(8), rate, cmap=COLOUR_MAP, vmin=0.0, vmax=1.0,
        edgecolors="white", linewidth=0.5,
    )  # fmt: skip
    for day, hour in np.ndindex(*rate.shape):
        if not watched[day, hour]:
            axes.fill_between([hour, hour + 1], day, day + 1, hatch="////", facecolor="none",
                              edgecolor=FAINT, linewidth=0.0)  # fmt: skip
        colour = "white" if rate[day, hour] > DARK else INK
        axes.text(hour + 0.5, day + 0.5, f"{100 * rate[day, hour]:.0f}", color=colour,
                  fontsize=SMALL - 2.0, ha="center", va="center")  # fmt: skip
    axes.set(xticks=np.arange(0, 25, 3), yticks=np.arange(7) + 0.5, ylim=(7, 0))
    axes.set_yticklabels(DAYS)
    axes.set_xlabel(f"hour ({week['timezone']})", fontsize=MEDIUM)
    axes.set_title(f"P(state = 1) in percent {title}".strip(), fontsize=MEDIUM)
    plain_axes(axes)
    bar = axes.figure.colorbar(mesh, ax=axes, pad=0.01)
    bar.ax.tick_params(labelsize=SMALL)


def draw_hours(axes: Axes, week: dict[str, Any] | Array | None, title: str) -> None:
    """A small heat map of hours (columns) by weekdays (rows), from white (0) to dark (1): rates
    (7, 24), or of a week of `DoorForecast.to_dict` those of the hours that were watched; grey where
    there is none."""
    if isinstance(week, dict):
        week = np.where(np.array(week["watched_hours"]) > 0, np.array(week["rate"]), np.nan)
    rate = np.ma.masked_invalid(np.full((7, 24), np.nan) if week is None else week)
    colours = colormaps[COLOUR_MAP].with_extremes(bad=FAINT)
    axes.imshow(rate, cmap=colours, vmin=0.0, vmax=1.0, aspect="auto", extent=(0, 24, 7, 0))
    axes.set_xticks(range(0, 25, 3))
    axes.set_yticks(np.arange(7) + 0.5, DAYS)
    axes.tick_params(labelsize=SMALL - 2.0)
    axes.set_title(title, fontsize=SMALL)


def _draw_reliability(axes: Axes, calibrations: Sequence[Calibration]) -> None:
    axes.plot([0, 1], [0, 1], color=FAINT, linewidth=1.0)
    for k, (name, diagram) in enumerate(calibrations):
        count, told, share = map(np.array, diagram)
        some = count >= MIN_LOOKS
        axes.plot(told[some], share[some], color=COLOURS[k % 4], marker=MARKERS[k % 4],
                  markersize=4, linewidth=1.2,
                  label=f"{name} (ECE {calibration_error(diagram):.3f})")  # fmt: skip
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
    axes.set_xlabel("forecast", fontsize=MEDIUM)
    axes.set_ylabel("share of the minutes in state 1", fontsize=MEDIUM)
    axes.set_title("Reliability, by time since the look", fontsize=MEDIUM)
    plain_axes(axes)
    axes.legend(frameon=False, fontsize=SMALL - 1.5, loc="upper left")
