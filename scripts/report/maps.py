"""The maps of every variant side by side, on the same episode, with the truth."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb

from ..figures.style import DOORS, ESTIMATE, SMALL, TRUTH, UNKNOWN, WALLS, blank_figure, plain_axes
from ..trials.recorded_run import RecordedRun
from ..trials.results import Condition
from .charts import Chart

COLUMNS = 2
PANEL_WIDTH = 5.0  # inches
PALETTE = np.vstack(
    [
        np.repeat(np.linspace(255, 0, 255).round()[:, None], 3, axis=1),
        255 * np.array(to_rgb(UNKNOWN)),
    ]
).astype(np.uint8)
"""(256, 3) colours of an recorded run's shades."""


def maps(condition: Condition, runs: Mapping[str, RecordedRun], number: int) -> Chart:
    """One panel a variant, at the end of the episode."""
    box = _box(list(runs.values()))
    aspect = (box[3] - box[2]) / (box[1] - box[0])
    rows = -(-len(runs) // COLUMNS)
    figure = blank_figure(PANEL_WIDTH * COLUMNS, (PANEL_WIDTH * aspect + 0.3) * rows + 0.3)
    for k, (variant, run) in enumerate(runs.items(), 1):
        axes = figure.add_subplot(rows, COLUMNS, k)
        axes.set_facecolor(UNKNOWN)
        axes.imshow(PALETTE[run.shades[-1]], extent=run.extent, origin="lower",
                    interpolation="auto")  # fmt: skip
        for segments, ink, label in ((run.walls, WALLS, "true walls"),
                                     (run.doors[-1], DOORS, "true doors")):  # fmt: skip
            lines = list(segments.reshape(-1, 2, 2))
            axes.add_collection(LineCollection(lines, colors=ink, linewidths=0.8, label=label))
        axes.plot(*run.truth[:, :2].T, color=TRUTH, linewidth=2.0, label="true path")
        axes.plot(*run.poses[:, :2].T, color=ESTIMATE, linewidth=0.8, label="estimated path")
        axes.set(xlim=box[:2], ylim=box[2:], aspect="equal")
        axes.set_title(variant, fontsize=SMALL + 1)
        plain_axes(axes)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=SMALL,
                  frameon=False)  # fmt: skip
    caption = (
        "The maps at the end of the first episode: occupied dark, free white, unknown grey. Paths "
        "as believed at the end."
    )
    return Chart(f"maps-{number}", f"Maps: {condition}", caption, figure)


def _box(runs: list[RecordedRun]) -> tuple[float, float, float, float]:
    """What is true, or (without a truth) what most maps hold: left, right, bottom, top, m."""
    walls = runs[0].walls.reshape(-1, 2)
    if len(walls):
        (left, bottom), (right, top) = walls.min(axis=0).tolist(), walls.max(axis=0).tolist()
        return left - 0.4, right + 0.4, bottom - 0.4, top + 0.4
    extents = np.array([run.extent for run in runs])
    left, right, bottom, top = np.median(extents, axis=0).tolist()
    return left, right, bottom, top
