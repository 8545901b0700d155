"""A map with the truth thin over it, so that an eye sees the error."""

from __future__ import annotations

from matplotlib.figure import Figure

from slam.episode import Truth
from slam.geometry import Array
from slam.grid import OccupancyGrid

from .map_panel import MapPanel, draw_panel
from .style import DPI, SMALL, blank_figure

WIDTH, TALLEST = 8.5, 9.5  # inches
FURNITURE = 0.6, 1.1  # inches beside and above the map, for labels, title and legend
SHARPEST = 320.0  # dots per inch, at most


def map_figure(
    grid: OccupancyGrid,
    poses: Array | None = None,
    truth: Truth | None = None,
    scan: int = -1,
    title: str = "",
) -> Figure:
    """One map.

    grid   the map: occupied dark, free white, unknown grey
    poses  (n, 3) the estimated trajectory in the map's frame
    truth  walls, doors and path that are drawn thin over the map
    scan   the scan at which the true doors are shown, negative from the end
    title  a line above
    """
    panel = MapPanel(title, grid, poses, truth, scan)
    box = panel.box
    scale = min((WIDTH - FURNITURE[0]) / box.width, (TALLEST - FURNITURE[1]) / box.height)
    width, height = box.width * scale + FURNITURE[0], box.height * scale + FURNITURE[1]
    cells_per_inch = 1.0 / (scale * grid.spec.resolution)
    figure = blank_figure(max(width, 4.0), height, min(max(cells_per_inch, DPI), SHARPEST))
    axes = figure.add_subplot()
    draw_panel(axes, panel, box)
    add_legend(figure)
    return figure


def add_legend(figure: Figure) -> None:
    """One legend below, of the lines in the figure's first axes."""
    handles, labels = figure.axes[0].get_legend_handles_labels()
    if handles:
        figure.legend(
            handles, labels, loc="outside lower center", ncol=4, fontsize=SMALL, frameon=False
        )
