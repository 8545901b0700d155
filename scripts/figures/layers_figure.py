"""Figure of the layers of a map, with a legend, a scale bar and the numbers of the doors."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from slam.layers import Layers

from .joining import cut, fold_for, joined
from .layer_cells import NAMES, NEVER_SEEN, palette, ranked
from .map_figure import MAX_DPI, PIXELS_PER_CELL
from .map_panel import Box, MapPanel
from .style import DPI, PAPER, SMALL, blank_figure, plain_axes

MAX_SIDE = 9.0  # inches, of the map
LABEL_WIDTH, LABEL_HEIGHT = 0.6, 1.2  # inches beside the map, for labels, title and legend
MIN_WIDTH = 5.5  # inches, so that the legend has room
SURE_COLOUR, PERHAPS_COLOUR = "#0050d0", "#4a90e2"
BAR_SHARE = 0.2  # of the map's width, of the scale bar, at most
ARROW = 18.0  # points, of the arrow that points along y
HALO = (withStroke(linewidth=2.5, foreground=PAPER),)  # readable on any map


def layers_figure(layers: Layers, title: str = "") -> Figure:
    """The layers, cut to what was seen but for stray beams; doors are numbered as in the terminal
    and doors.geojson. A cell covers a pixel or more, larger maps are drawn in joined cells."""
    box = MapPanel("", layers.static_map()).box
    scale = MAX_SIDE / max(box.width, box.height)
    fold = fold_for(layers.spec.resolution, PIXELS_PER_CELL / (scale * MAX_DPI))
    spec, cells = joined(*cut(layers.spec, ranked(layers), box), fold)
    dpi = max(PIXELS_PER_CELL / (scale * spec.resolution), DPI)
    width, height = box.width * scale + LABEL_WIDTH, box.height * scale + LABEL_HEIGHT
    figure = blank_figure(max(width, MIN_WIDTH), height, dpi)
    axes = figure.add_subplot(facecolor=palette()[NEVER_SEEN] / 255)
    axes.imshow(palette()[cells], origin="lower", extent=spec.extent, interpolation="nearest")
    _draw_doors(axes, layers)
    axes.set(xlim=box[:2], ylim=box[2:], aspect="equal", title=title)
    axes.set_xlabel("x [m]", fontsize=SMALL, labelpad=1)
    axes.set_ylabel("y [m]", fontsize=SMALL, labelpad=1)
    plain_axes(axes)
    _scale_bar(axes, box)
    _legend(figure, layers)
    return figure


def _draw_doors(axes: Axes, layers: Layers) -> None:
    for number, door in enumerate(layers.doors, 1):
        colour = SURE_COLOUR if door.sure else PERHAPS_COLOUR
        axes.plot(*door.ends.T, color=colour, linewidth=2.0, solid_capstyle="butt")
        axes.annotate(str(number), door.ends.mean(axis=0), xytext=(4, 4), color=colour,
                      textcoords="offset points", fontsize=SMALL, weight="bold",
                      path_effects=HALO)  # fmt: skip


def _scale_bar(axes: Axes, box: Box) -> None:
    """A bar of 1, 2 or 5 times a power of ten m in the lower left corner, along x; from its end an
    arrow along y, the north of the map."""
    most = BAR_SHARE * box.width
    power = 10.0 ** np.floor(np.log10(most))
    length = max(n * power for n in (1, 2, 5) if n * power <= most)
    margin = 0.04 * min(box.width, box.height)
    x, y = box.left + margin, box.bottom + margin
    axes.plot([x, x + length], [y, y], color="black", linewidth=2.5, solid_capstyle="butt",
              path_effects=HALO)  # fmt: skip
    axes.annotate(f"{length:g} m", (x + length / 2, y), xytext=(0, 4), ha="center",
                  textcoords="offset points", fontsize=SMALL, path_effects=HALO)  # fmt: skip
    arrow = {"arrowstyle": "<|-", "color": "black", "path_effects": HALO}
    axes.annotate("y", (x, y), xytext=(0, ARROW), ha="center", textcoords="offset points",
                  fontsize=SMALL, arrowprops=arrow, path_effects=HALO)  # fmt: skip


def _legend(figure: Figure, layers: Layers) -> None:
    """What the colours mean, below the map."""
    handles: list[Patch | Line2D] = [
        Patch(facecolor=palette()[number] / 255, edgecolor="0.5", label=label)
        for number, label in NAMES.items()
    ]
    sure = sum(door.sure for door in layers.doors)
    counts = (
        (sure, "doors", SURE_COLOUR),
        (len(layers.doors) - sure, "perhaps doors", PERHAPS_COLOUR),
    )
    for count, name, colour in counts:
        if count:
            handles.append(Line2D([], [], color=colour, linewidth=2.0, label=f"{name}: {count}"))
    figure.legend(
        handles=handles, loc="outside lower center", ncol=3, fontsize=SMALL, frameon=False
    )
