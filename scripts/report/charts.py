"""The figures of a bench, but for its maps, for the page and for a paper."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slam.benchmark.statistics import median

from ..figures.style import FAINT, INK, MEDIUM, SMALL, blank_figure, plain_axes
from ..trials.results import Condition
from .scores import ATE, MEMORY, TIME, Score, format_p
from .summary import Group, Summary

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F4F24", "#6A3D9A",
           "#555555", "#B2DF8A")  # fmt: skip
MARKERS = "osD^vP*Xhd"
MOST_PANELS = 6


class Chart(NamedTuple):
    """A figure, and what it says.

    name     of its files
    title    above it
    caption  below it: what is to be seen, for those who cannot see it as well
    """

    name: str
    title: str
    caption: str
    figure: Figure


def charts(summary: Summary) -> Iterator[Chart]:
    """All that the results allow."""
    if summary.main is None:
        return
    for chart in (
        _ranks(summary, summary.main),
        _errors(summary, summary.main),
        _over_time(summary),
        _calibration(summary),
        _speed(summary, summary.main),
        _memory(summary),
        _bound(summary),
    ):
        if chart is not None:
            yield chart


def colour(summary: Summary, variant: str) -> str:
    """The same in every figure."""
    return COLOURS[summary.variants.index(variant) % len(COLOURS)]


def shown(summary: Summary) -> list[Condition]:
    """At most `MOST_PANELS` conditions: those where the variants differ most."""
    score = summary.main
    if len(summary.conditions) <= MOST_PANELS or score is None:
        return summary.conditions[:MOST_PANELS]

    def spread(condition: Condition) -> float:
        groups = [group.values(score) for group in summary.of(condition)]
        found = [float(np.median(values)) for values in groups if values]
        known = [value for value in found if value > 0]
        return max(known) / min(known) if known and min(known) < np.inf else 0.0

    chosen = sorted(summary.conditions, key=spread, reverse=True)[:MOST_PANELS]
    return [condition for condition in summary.conditions if condition in chosen]


def _ranks(summary: Summary, score: Score) -> Chart | None:
    found = summary.ranks()
    if found is None:
        return None
    (means, p), episodes = found
    figure = blank_figure(6.5, 0.9 + 0.28 * len(means))
    axes = figure.add_subplot()
    for y, (name, mean) in enumerate(zip(summary.variants, means, strict=True)):
        _interval(axes, y, mean, colour(summary, name))
    axes.set_yticks(range(len(means)), summary.variants)
    axes.invert_yaxis()
    axes.set_xlabel(f"mean rank by {score.name} (1 is best)", fontsize=MEDIUM)
    _finish(axes)
    caption = (
        f"Mean rank over the {episodes} episodes that all {summary.wording.compared}s were run on, "
        f"with bootstrap 95 % intervals; Friedman's test of no difference: {format_p(p)}."
    )
    return Chart("ranks", "Ranks", caption, figure)


def _errors(summary: Summary, score: Score) -> Chart | None:
    """Every run as a dot."""
    conditions = shown(summary)
    rows = sum(len(summary.of(c)) for c in conditions) + len(conditions)
    figure = blank_figure(7.5, 0.8 + 0.2 * rows)
    axes, y, ticks = figure.add_subplot(), 0, []
    for condition in conditions:
        axes.text(0.005, y, str(condition), transform=axes.get_yaxis_transform(),
                  fontsize=SMALL, fontweight="bold", va="center", color=INK)  # fmt: skip
        y += 1
        for group in summary.of(condition):
            values = np.array([v for v in group.values(score) if np.isfinite(v)])
            ink = colour(summary, group.variant)
            spread = 0.25 * np.sin(2.4 * np.arange(len(values)))
            axes.plot(values, y + spread, ".", color=ink, alpha=0.35, markersize=4, zorder=2,
                      rasterized=True)  # fmt: skip
            _interval(axes, y, group.median(score), ink)
            ticks.append((y, group.variant))
            y += 1
    axes.set_yticks([at for at, _ in ticks], [name for _, name in ticks])
    axes.set_ylim(y - 0.4, -0.8)
    _log(axes, "x")
    axes.set_xlabel(score.heading, fontsize=MEDIUM)
    _finish(axes)
    caption = "Each run as a dot; the median and its bootstrap 95 % interval as a bar."
    return Chart("errors", f"{score.name} of every run", caption + _most(summary), figure)


def _over_time(summary: Summary) -> Chart | None:
    conditions = [c for c in shown(summary) if any(_curves(g) for g in summary.of(c))]
    if not conditions:
        return None
    figure, panels = _panels(len(conditions), 2.6)
    for axes, condition in zip(panels, conditions, strict=True):
        for group in summary.of(condition):
            curves = _curves(group)
            if not curves:
                continue
            length = min(map(len, curves))
            low, middle, high = 1e3 * np.percentile([c[:length] for c in curves], [25, 50, 75], 0)
            lengths = [row["duration"] for row in group.rows if row.get("error_curve")]
            time = np.linspace(0, float(np.median(lengths)), length)
            ink = colour(summary, group.variant)
            axes.plot(time, middle, color=ink, linewidth=1.3, label=group.variant)
            axes.fill_between(time, low, high, color=ink, alpha=0.15, linewidth=0)
        _log(axes, "y")
        axes.set_title(str(condition), fontsize=MEDIUM)
        axes.set_xlabel("time, s", fontsize=SMALL)
        axes.set_ylabel("position error, mm", fontsize=SMALL)
        _finish(axes)
    _legend(figure, panels)
    caption = "Error of the position along the drive: median over the episodes, middle half shaded."
    return Chart("error-over-time", "Error over time", caption + _most(summary), figure)


def _calibration(summary: Summary) -> Chart | None:
    conditions = [c for c in shown(summary) if any(_tables(g) for g in summary.of(c))]
    if not conditions:
        return None
    figure, panels = _panels(len(conditions), 3.0)
    for axes, condition in zip(panels, conditions, strict=True):
        axes.plot([0, 1], [0, 1], color=FAINT, linewidth=1.0)
        for group in summary.of(condition):
            tables = _tables(group)
            if not tables:
                continue
            cells = np.array([t["cells"] for t in tables])
            total = cells.sum(axis=0)
            some = total >= 50
            believed, occupied = (
                (cells * [t[name] for t in tables]).sum(axis=0)[some] / total[some]
                for name in ("believed", "occupied")
            )
            ink, mark = colour(summary, group.variant), _marker(summary, group)
            axes.plot(believed, occupied, color=ink, linewidth=1.2, marker=mark, markersize=3.5,
                      label=group.variant)  # fmt: skip
        axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
        axes.set_title(str(condition), fontsize=MEDIUM)
        axes.set_xlabel("h of the map", fontsize=SMALL)
        axes.set_ylabel("share of time occupied", fontsize=SMALL)
        _finish(axes)
    _legend(figure, panels)
    caption = (
        "What the maps' cells say (h, in ten bins of 50 cells or more) against the share of time "
        "that something truly stood in them; a calibrated map is on the diagonal."
    )
    return Chart("calibration", "Calibration of the maps", caption + _most(summary), figure)


def _speed(summary: Summary, score: Score) -> Chart | None:
    """One point a variant and condition."""
    chart = _scatter(summary, TIME, score)
    caption = (
        "Medians with their 95 % intervals, of the runs that have a result; lower and farther "
        "left is better. Times were taken beside other runs on the same machine."
    )
    return chart and Chart("accuracy-speed", "Accuracy against speed", caption, chart)


def _memory(summary: Summary) -> Chart | None:
    chart = _scatter(summary, TIME, MEMORY)
    caption = (
        "How much more memory the process held at most during a run than before it, against the "
        "time of a matched scan; medians with their 95 % intervals."
    )
    return chart and Chart("memory-time", "Memory against time", caption, chart)


def _bound(summary: Summary) -> Chart | None:
    bound = Score("ate_bound", "Cramer-Rao bound of one scan", 1e3, " mm")
    chart = _scatter(summary, bound, ATE, diagonal=True)
    caption = (
        "The error reached against the least one of poses found each from one scan in the known "
        "map: what no localization without memory can beat. Of the runs that have a result."
    )
    return chart and Chart("bound", "Bound against achieved", caption, chart)


def _scatter(summary: Summary, x: Score, y: Score, diagonal: bool = False) -> Figure | None:
    figure = blank_figure(6.5, 4.2)
    axes, drawn = figure.add_subplot(), set[str]()
    for group in summary.groups.values():
        a, b = (median([v for v in group.values(s) if np.isfinite(v)]) for s in (x, y))
        if not (np.isfinite(a).all() and np.isfinite(b).all()):
            continue
        ink, name = colour(summary, group.variant), group.variant
        axes.plot([a.low, a.high], [b.value] * 2, color=ink, linewidth=0.8, alpha=0.6)
        axes.plot([a.value] * 2, [b.low, b.high], color=ink, linewidth=0.8, alpha=0.6)
        axes.plot(a.value, b.value, _marker(summary, group), color=ink, markersize=5,
                  label=None if name in drawn else name)  # fmt: skip
        drawn.add(name)
    if not drawn:
        return None
    _log(axes, "x")
    _log(axes, "y")
    if diagonal:
        low, high = axes.get_xlim()
        axes.plot([low, high], [low, high], color=FAINT, linewidth=1.0, zorder=1)
        axes.set_xlim(low, high)
    axes.set_xlabel(x.heading, fontsize=MEDIUM)
    axes.set_ylabel(y.heading, fontsize=MEDIUM)
    _finish(axes)
    _legend(figure, [axes])
    return figure


def _curves(group: Group) -> list[list[float]]:
    return [row["error_curve"] for row in group.rows if row.get("error_curve")]


def _tables(group: Group) -> list[dict[str, list[float]]]:
    return [row["calibration"] for row in group.rows if row.get("calibration")]


def _panels(count: int, height: float) -> tuple[Figure, list[Axes]]:
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = blank_figure(4.2 * columns, height * rows + 0.5)
    return figure, [figure.add_subplot(rows, columns, k + 1) for k in range(count)]


def _interval(axes: Axes, y: float, interval: Sequence[float], ink: str) -> None:
    """A value as a mark with its interval as a bar; what is infinite is left out."""
    value, low, high = interval
    if np.isfinite(low):
        end = high if np.isfinite(high) else 10 * low
        axes.plot([low, end], [y, y], color=ink, linewidth=2.2, zorder=3)
    if np.isfinite(value):
        axes.plot(value, y, "o", color=ink, markersize=5.5, markeredgecolor="white", zorder=4)


def _marker(summary: Summary, group: Group) -> str:
    return MARKERS[summary.conditions.index(group.condition) % len(MARKERS)]


def _log(axes: Axes, which: str) -> None:
    """Logarithmic, with plain numbers, where anything was drawn."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    low, high = axes.dataLim.intervalx if which == "x" else axes.dataLim.intervaly
    if not (np.isfinite(low) and np.isfinite(high) and high > 0):
        return
    (axes.set_xscale if which == "x" else axes.set_yscale)("log", nonpositive="mask")
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    few = high / max(low, 1e-9) < 30
    axis.set_minor_formatter(
        lambda value, _: f"{value:g}" if few and f"{value:.0e}"[0] in "25" else ""
    )


def _finish(axes: Axes) -> None:
    plain_axes(axes)
    axes.tick_params(which="minor", labelsize=SMALL - 1, colors=INK, length=2)
    axes.grid(color=FAINT, alpha=0.35, linewidth=0.5, which="both")
    axes.set_axisbelow(True)


def _legend(figure: Figure, panels: Sequence[Axes]) -> None:
    named = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        named |= {label: handle for handle, label in zip(handles, labels, strict=True)}
    if named:
        figure.legend(named.values(), named.keys(), loc="outside lower center", frameon=False,
                      ncols=min(4, len(named)), fontsize=SMALL)  # fmt: skip


def _most(summary: Summary) -> str:
    """What to add where not all conditions are shown."""
    if len(summary.conditions) <= MOST_PANELS:
        return ""
    compared = f"{summary.wording.compared}s"
    return (
        f" Of {len(summary.conditions)} conditions the {MOST_PANELS} where {compared} differ most."
    )
