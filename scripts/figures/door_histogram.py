"""The paper's figure 1: the histogram of a door's cell beside the same cell of a static map."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.grid import OccupancyGrid
from slam.maps.histogram import Histogram
from slam.metrics.change import TrueOccupancy

from .known_poses import known, mapped
from .map_panel import Box, draw_map, draw_truth
from .style import (
    DYNAMIC,
    ESTIMATE,
    FAINT,
    LARGE,
    MEDIUM,
    PAPER,
    SMALL,
    STATIC,
    TRUTH,
    blank_figure,
    plain_axes,
)

SHOWN_RANGE = 1.25  # m of map on each side of the cell


def door_histogram_figure(
    moving: Episode, static: str = "static-ml", dynamic: str = "dynamic-ml"
) -> Figure:
    """The histogram of the door cell that was seen in both states most evenly.

    Both maps are made at the true poses.

    moving   an episode with doors that move, and its truth
    static   a variant to compare with
    dynamic  a variant whose map is a Histogram
    """
    truth = known(moving)
    remembered, summed = (
        mapped(dynamic, moving).map_model,
        mapped(static, moving).map_model.cells.grid(),
    )
    if not isinstance(remembered, Histogram):
        raise InputError(f"figure 1 needs a variant with a histogram map, {dynamic!r} has none")
    seen = remembered.cells.grid()
    share = TrueOccupancy(truth, seen.spec.resolution)
    row, col = door_cell(remembered, share)
    x, y = seen.spec.centres(np.array([[row, col]]))[0].tolist()
    there = summed.spec.cells(np.array([[x, y]]))[0]
    h, frozen = float(seen.occupied[row, col]), float(summed.occupied[tuple(there)])
    q = _at(share, x, y)
    beliefs = {
        f"dynamic map, the mean (h): {h:.2f}": (h, DYNAMIC),
        f"static map: {frozen:.2f} (log-odds {_log_odds(frozen):+.1f})": (frozen, STATIC),
        f"true share of the drive occupied: {q:.2f}": (q, TRUTH),
    }
    figure = blank_figure(9.0, 3.9)
    left, right = figure.subplots(1, 2, width_ratios=(1.45, 1.0))
    _draw_bars(left, remembered.histogram(row, col), beliefs)
    _draw_place(right, seen, truth, x, y)
    return figure


def door_cell(remembered: Histogram, truth: TrueOccupancy) -> tuple[int, int]:
    """Row and column of the cell that a door sweeps and that was seen in both states most evenly.

    The most windows in the rarer of the two states; of equals the most in all, then the first.
    """
    grid = remembered.cells.grid()
    rows, cols = np.nonzero((truth.share > 0) & (truth.share < 1))
    cells = grid.spec.cells(truth.spec.centres(np.column_stack([rows, cols])))
    inside = ((cells >= 0) & (cells < grid.spec.shape)).all(axis=1)
    cells = [(row, col) for row, col in cells[inside].tolist() if grid.observed[row, col]]
    if not cells:
        raise InputError("figure 1 needs an episode in which a door moved and was seen")
    counts = np.array([remembered.histogram(row, col) for row, col in cells])
    free, occupied = (
        counts[:, : remembered.bins // 2].sum(axis=1),
        counts[:, remembered.bins // 2 :].sum(axis=1),
    )
    best = np.lexsort((-(free + occupied), -np.minimum(free, occupied)))[0]
    return cells[best]


def _at(truth: TrueOccupancy, x: float, y: float) -> float:
    return float(truth.share[tuple(truth.spec.cells(np.array([[x, y]]))[0])])


def _draw_bars(axes: Axes, counts: np.ndarray, beliefs: dict[str, tuple[float, str]]) -> None:
    bins = np.linspace(0.0, 1.0, len(counts))
    axes.bar(
        bins,
        counts,
        width=0.8 / (len(counts) - 1),
        color=FAINT,
        label="windows of time, by occupancy",
    )
    for label, (value, colour) in beliefs.items():
        axes.axvline(value, color=colour, linewidth=2.0, label=label)
    axes.set(xlim=(-0.08, 1.08), ylim=(0, 1.7 * counts.max()))  # leaves room for the legend
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("occupancy reached within a window (free 0, occupied 1)", fontsize=MEDIUM)
    axes.set_ylabel("number of windows", fontsize=MEDIUM)
    axes.set_title("Figure 1: the histogram of a door's cell", fontsize=LARGE)
    plain_axes(axes)
    axes.legend(fontsize=SMALL, loc="upper left", facecolor=PAPER, edgecolor=FAINT, framealpha=1.0)


def _log_odds(probability: float) -> float:
    clipped = min(max(probability, 1e-9), 1 - 1e-9)
    return math.log(clipped / (1 - clipped))


def _draw_place(axes: Axes, grid: OccupancyGrid, truth: Truth, x: float, y: float) -> None:
    draw_map(axes, grid, Box(x - SHOWN_RANGE, x + SHOWN_RANGE, y - SHOWN_RANGE, y + SHOWN_RANGE))
    draw_truth(axes, truth, -1)
    half = grid.spec.resolution / 2
    square = Rectangle((x - half, y - half), 2 * half, 2 * half)
    square.set(fill=False, edgecolor=ESTIMATE, linewidth=2.0, zorder=4)
    axes.add_patch(square)
    place = f"the cell at\n({x:.2f}, {y:.2f}) m"
    aside = {"xytext": (16, 16), "textcoords": "offset points", "fontsize": SMALL, "zorder": 5}
    box = {"facecolor": PAPER, "edgecolor": ESTIMATE, "boxstyle": "round"}
    axes.annotate(
        place, (x, y), bbox=box, arrowprops={"arrowstyle": "-", "color": ESTIMATE}, **aside
    )
    axes.set_title("the cell in the dynamic map", fontsize=LARGE)
