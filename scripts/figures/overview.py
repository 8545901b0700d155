"""The paper's figures 4 to 7 in one picture."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from .map_figure import add_legend
from .map_panel import MapPanel, draw_panel
from .style import MEDIUM, blank_figure

COLUMNS = 2
PANEL_WIDTH = 5.0  # inches


def overview_figure(panels: Sequence[MapPanel]) -> Figure:
    """All maps side by side in two columns, each cut to a box of the shape of the flattest."""
    boxes = [panel.box for panel in panels]
    aspect = min(box.height / box.width for box in boxes)
    rows = -(-len(panels) // COLUMNS)
    figure = blank_figure(PANEL_WIDTH * COLUMNS, (PANEL_WIDTH * aspect + 0.3) * rows + 0.3)
    for number, (panel, box) in enumerate(zip(panels, boxes, strict=True), start=1):
        axes = figure.add_subplot(rows, COLUMNS, number)
        draw_panel(axes, panel, box.shaped(aspect))
        axes.title.set_fontsize(MEDIUM)
    add_legend(figure)
    return figure
