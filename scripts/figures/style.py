"""Colours that colour-blind readers can tell apart (Okabe and Ito 2008), and blank figures.

Figures are made without pyplot, so that they share no state and need no display.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

PAPER, INK, FAINT = "#FFFFFF", "#282A30", "#B0B4BC"
UNKNOWN = "#C8D1DE"  # no beam has reached it: bluish, unlike the grey of a half occupied cell
TRUTH, ESTIMATE = "#0072B2", "#D55E00"
WALLS, DOORS = "#56B4E9", "#E69F00"
STATIC, DYNAMIC = "#CC79A7", "#009E73"
LOST = "#9900FF"  # far from all colours of a map and its lines, for the colour-blind too

SMALL, MEDIUM, LARGE = 8.0, 9.5, 11.0  # points
DPI = 130.0


def blank_figure(width: float, height: float, dpi: float = DPI, arrange: bool = True) -> Figure:
    """An empty figure of `width` x `height` inches; `arrange` lets matplotlib lay out its parts."""
    figure = Figure(figsize=(width, height), dpi=dpi, facecolor=PAPER)
    FigureCanvasAgg(figure)
    if arrange:
        figure.set_layout_engine("compressed", h_pad=0.08)
    return figure


def rendered(figure: Figure) -> Image.Image:
    """The figure as a picture in RGB, a frame of a film."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())


def plain_axes(axes: Axes) -> None:
    """Give the axes small ticks and a faint frame."""
    axes.tick_params(labelsize=SMALL, colors=INK, length=3, width=0.6)
    for spine in axes.spines.values():
        spine.set(color=FAINT, linewidth=0.8)
