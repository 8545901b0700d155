"""Phase diagrams: planes of two factors, one panel a variant. Where does which one break?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm

from slam.geometry import Array

from ..figures.style import INK, MEDIUM, SMALL, blank_figure, plain_axes
from ..trials.results import Condition
from .charts import Chart, colour
from .scores import Score
from .summary import Comparison, Summary

PLANE = "plane"
DARK = 0.6  # of the colours' range, above which text is white


def phase_diagrams(summary: Summary) -> Iterator[Chart]:
    """One chart a plane: conditions that name their `plane`, and two more factors."""
    score = summary.main
    planes = dict.fromkeys(dict(c.factors).get(PLANE) for c in summary.conditions)
    for plane in planes:
        if plane is None or score is None:
            continue
        conditions = [c for c in summary.conditions if dict(c.factors).get(PLANE) == plane]
        names = [name for name, _ in conditions[0].factors if name != PLANE]
        if len(names) == 2:
            yield _diagram(summary, score, str(plane), conditions, names)


def _diagram(
    summary: Summary, score: Score, plane: str, conditions: list[Condition], names: list[str]
) -> Chart:
    levels = [sorted({dict(c.factors)[name] for c in conditions}) for name in names]
    cells = {tuple(dict(c.factors)[name] for name in names): c for c in conditions}
    shape = len(levels[1]), len(levels[0])
    places = [(row, col, cells.get((x, y))) for row, y in enumerate(levels[1])
              for col, x in enumerate(levels[0])]  # fmt: skip
    medians = np.full((len(summary.variants), *shape), np.nan)
    lost = np.full_like(medians, np.nan)
    for k, variant in enumerate(summary.variants):
        for row, col, condition in places:
            group = condition and summary.groups.get((condition, variant))
            if group:
                medians[k, row, col] = group.median(score).value
                lost[k, row, col] = group.failed().value
    columns = min(3, len(summary.variants) + 1)
    rows = -(-(len(summary.variants) + 1) // columns)
    figure = blank_figure(3.5 * columns, (0.55 * shape[0] + 1.0) * rows)
    known = medians[np.isfinite(medians) & (medians > 0)]
    norm = LogNorm(known.min(), max(known.max(), 1.01 * known.min())) if len(known) else None
    for k, variant in enumerate(summary.variants):
        axes = figure.add_subplot(rows, columns, k + 1)
        axes.imshow(medians[k], origin="lower", aspect="auto", norm=norm, cmap="viridis_r")
        for row, col, _ in places:
            if not np.isnan(medians[k, row, col]):
                shade = float(np.ma.filled(norm(medians[k, row, col]), 0.0)) if norm else 0.0
                _write(axes, row, col, score.told(medians[k, row, col]), lost[k, row, col], shade)
        _label(axes, variant, names, levels)
    axes = figure.add_subplot(rows, columns, len(summary.variants) + 1)
    _best(axes, summary, medians, places)
    _label(axes, "best median", names, levels)
    compared, first = summary.wording.compared, summary.variants[0]
    caption = (
        f"Median {score.heading}, and below it the share of runs that were lost, where not 0 %. "
        f"Last panel: the best {compared}; an asterisk where it beats {first} beyond "
        f"chance (Wilcoxon, corrected; {first} itself: beats all others)."
    )
    return Chart(f"phase-{plane}", f"Phase diagram: {plane}", caption, figure)


def _write(axes: Axes, row: int, col: int, told: str, lost: float, shade: float) -> None:
    text = told if not lost > 0 else f"{told}\n{lost:.0f} %"
    axes.text(col, row, text, ha="center", va="center", fontsize=SMALL,
              color="white" if shade > DARK else INK)  # fmt: skip


def _best(
    axes: Axes, summary: Summary, medians: Array, places: list[tuple[int, int, Condition | None]]
) -> None:
    filled = np.where(np.isnan(medians), np.inf, medians)
    best = filled.argmin(axis=0)
    colours = ListedColormap([colour(summary, name) for name in summary.variants])
    shown = np.where(np.isfinite(filled.min(axis=0)), best, np.nan)  # all lost: none is best
    axes.imshow(shown, origin="lower", aspect="auto", cmap=colours, alpha=0.55,
                vmin=-0.5, vmax=len(summary.variants) - 0.5)  # fmt: skip
    compared = [c for c in summary.comparisons() if c.score == summary.main]
    for row, col, condition in places:
        if condition is not None and np.isfinite(filled[:, row, col].min()):
            name = summary.variants[best[row, col]]
            told = name.replace("-", "-\n") + ("*" if _sure(name, condition, compared) else "")
            axes.text(col, row, told, ha="center", va="center", fontsize=SMALL - 1, color=INK)


def _sure(name: str, condition: Condition, compared: list[Comparison]) -> bool:
    """It beats the first variant beyond chance; or, if it is the first, all the others."""
    here = [c for c in compared if c.condition == condition]
    own = [c for c in here if c.variant == name]
    if own:
        return own[0].verdict == "better"
    return bool(here) and all(c.verdict == "worse" for c in here)


def _label(axes: Axes, title: str, names: list[str], levels: list[list[str | float]]) -> None:
    axes.set_title(title, fontsize=MEDIUM)
    axes.set_xticks(range(len(levels[0])), [f"{v}" for v in levels[0]])
    axes.set_yticks(range(len(levels[1])), [f"{v}" for v in levels[1]])
    axes.set_xlabel(names[0], fontsize=SMALL)
    axes.set_ylabel(names[1], fontsize=SMALL)
    plain_axes(axes)
