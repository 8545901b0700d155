"""Figure of the layers of a map, with a legend, a scale bar and the numbers of the doors."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from slam.io.layers import COLOURS, picture
from slam.layers import Layers

from .style import SMALL, blank_figure

MAX_SIDE = 9.0  # inches
MARGIN = 1.0  # m around what was seen
MIN_DPI, MAX_DPI = 150.0, 400.0
PIXELS_PER_CELL = 2.0  # if the resolution allows
SURE_COLOUR, PERHAPS_COLOUR = "#0050d0", "#7aa7ea"
BAR_SHARE = 0.2  # of the map's width, of the scale bar, at most
NAMES = {
    "static": "always occupied",
    "kept": "kept: seen once, or by some beams only",
    "mostly": "changing, mostly occupied",
    "seldom": "changing, seldom occupied",
    "free": "free",
    "unknown": "never seen",
}


def layers_figure(layers: Layers, title: str = "") -> Figure:
    """The layers, cut to what was seen; doors are numbered as in the terminal and doors.geojson."""
    rows, cols = np.nonzero(~layers.unknown)
    spec = layers.spec
    low = spec.centres(np.array([(rows.min(initial=0), cols.min(initial=0))]))[0] - MARGIN
    high = spec.centres(np.array([(rows.max(initial=1), cols.max(initial=1))]))[0] + MARGIN
    width, height = (high - low).tolist()
    scale = MAX_SIDE / max(width, height)
    dpi = min(max(PIXELS_PER_CELL / (scale * spec.resolution), MIN_DPI), MAX_DPI)
    figure = blank_figure(max(width * scale, 4.0), max(height * scale, 2.5) + 0.8, dpi)
    axes = figure.add_subplot()
    axes.imshow(picture(layers), origin="lower", extent=spec.extent, interpolation="nearest")
    for number, door in enumerate(layers.doors, 1):
        colour = SURE_COLOUR if door.sure else PERHAPS_COLOUR
        axes.plot(*door.ends.T, color=colour, linewidth=1.5)
        axes.annotate(str(number), door.ends.mean(axis=0), xytext=(4, 4), color=colour,
                      textcoords="offset points", fontsize=SMALL)  # fmt: skip
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_title(title)
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    _scale_bar(axes, width)
    _legend(figure, layers)
    return figure


def _scale_bar(axes: Axes, width: float) -> None:
    """A bar of 1, 2 or 5 times a power of ten m, in the lower left corner."""
    most = BAR_SHARE * width
    power = 10.0 ** np.floor(np.log10(most))
    length = max(n * power for n in (1, 2, 5) if n * power <= most)
    x, y = axes.get_xlim()[0] + 0.03 * width, axes.get_ylim()[0] + 0.03 * width
    axes.plot([x, x + length], [y, y], color="black", linewidth=2.5, solid_capstyle="butt")
    axes.annotate(f"{length:g} m", (x + length / 2, y), xytext=(0, 4), ha="center",
                  textcoords="offset points", fontsize=SMALL)  # fmt: skip


def _hex(colour: tuple[int, int, int]) -> str:
    return f"#{colour[0]:02x}{colour[1]:02x}{colour[2]:02x}"


def _legend(figure: Figure, layers: Layers) -> None:
    """What the colours mean, below the map."""
    handles: list[Patch | Line2D] = [
        Patch(facecolor=_hex(COLOURS[name]), edgecolor="0.5", label=label)
        for name, label in NAMES.items()
    ]
    sure = sum(door.sure for door in layers.doors)
    counts = (
        (sure, "doors", SURE_COLOUR),
        (len(layers.doors) - sure, "perhaps doors", PERHAPS_COLOUR),
    )
    for count, name, colour in counts:
        if count:
            handles.append(Line2D([], [], color=colour, label=f"{name}: {count}"))
    figure.legend(
        handles=handles, loc="outside lower center", ncol=3, fontsize=SMALL, frameon=False
    )
