"""Figures of maps, with the truth as thin lines that show the error."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slam.episode import Truth
from slam.geometry import Array
from slam.grid import OccupancyGrid

from .lost_course import LostCourse
from .lost_plot import draw_lost
from .map_panel import MapPanel, coarser, draw_panel
from .style import DPI, MEDIUM, SMALL, blank_figure

MAX_WIDTH, MAX_HEIGHT = 8.5, 9.5  # inches
LABEL_WIDTH, LABEL_HEIGHT = 0.6, 1.1  # inches beside the map, for labels, title and legend
LOST_PLOT_HEIGHT, LOST_HEIGHT = 0.6, 1.1  # inches of the plot below the map, and with its labels
MAX_DPI = 320.0
PIXELS_PER_CELL = 1.2  # if the resolution allows: with less, nearest pixels would skip cells
OVERVIEW_COLUMNS = 2
OVERVIEW_PANEL_WIDTH = 5.0  # inches


def map_figure(
    grid: OccupancyGrid,
    poses: Array | None = None,
    truth: Truth | None = None,
    scan: int = -1,
    title: str = "",
    lost: LostCourse | None = None,
) -> Figure:
    """One map; a cell of it covers a pixel or more, larger maps are drawn in coarser cells.

    grid   the map: occupied dark, free white, unknown grey
    poses  (n, 3) the estimated trajectory in the map's frame
    truth  walls, doors and path that are drawn as thin lines over the map
    scan   the scan at which the true doors are shown, negative from the end
    title  a line above
    lost   of the run; where the SLAM judged it, the poses at which the robot was lost are marked,
           and a plot below the map shows the probability over time
    """
    lost = lost if lost is not None and lost.judged else None
    panel = MapPanel(title, grid, poses, truth, scan, None if lost is None else lost.lost)
    box = panel.box
    scale = min((MAX_WIDTH - LABEL_WIDTH) / box.width, (MAX_HEIGHT - LABEL_HEIGHT) / box.height)
    grid = coarser(grid, PIXELS_PER_CELL / (scale * MAX_DPI))
    dpi = max(PIXELS_PER_CELL / (scale * grid.spec.resolution), DPI)
    width, height = box.width * scale + LABEL_WIDTH, box.height * scale + LABEL_HEIGHT
    figure = blank_figure(max(width, 4.0), height, dpi)
    draw_panel(_map_axes(figure, lost), panel._replace(grid=grid), box)
    add_legend(figure)
    return figure


def _map_axes(figure: Figure, lost: LostCourse | None) -> Axes:
    """The axes of the map; if `lost` is known, the figure grows by a plot of it."""
    if lost is None:
        return figure.add_subplot()
    width, height = figure.get_size_inches()
    figure.set_size_inches(width, height + LOST_HEIGHT)
    grid = figure.add_gridspec(2, height_ratios=[height - LABEL_HEIGHT, LOST_PLOT_HEIGHT])
    axes = figure.add_subplot(grid[0])
    draw_lost(figure.add_subplot(grid[1]), lost)
    return axes


def overview_figure(panels: Sequence[MapPanel]) -> Figure:
    """Maps side by side in two columns, each cut to a box of the shape of the flattest."""
    boxes = [panel.box for panel in panels]
    aspect = min(box.height / box.width for box in boxes)
    rows, width = -(-len(panels) // OVERVIEW_COLUMNS), OVERVIEW_PANEL_WIDTH
    figure = blank_figure(width * OVERVIEW_COLUMNS, (width * aspect + 0.3) * rows + 0.3)
    for number, (panel, box) in enumerate(zip(panels, boxes, strict=True), start=1):
        axes, shown = figure.add_subplot(rows, OVERVIEW_COLUMNS, number), box.shaped(aspect)
        grid = coarser(panel.grid, PIXELS_PER_CELL * shown.width / ((width - LABEL_WIDTH) * DPI))
        draw_panel(axes, panel._replace(grid=grid), shown)
        axes.title.set_fontsize(MEDIUM)
    add_legend(figure)
    return figure


def add_legend(figure: Figure) -> None:
    """One legend below, of all lines that have a label, each label once."""
    named = {
        label: handle
        for axes in figure.axes
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    if named:
        figure.legend(
            list(named.values()),
            list(named),
            loc="outside lower center",
            ncol=4,
            fontsize=SMALL,
            frameon=False,
        )
