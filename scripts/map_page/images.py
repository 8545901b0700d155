"""The layers of a map as small pictures: one byte a cell, the most important colour the highest.

Where cells are joined, the highest byte is kept, so that thin walls stay.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from PIL import Image, ImageColor

from slam.grid import GridSpec, OccupancyGrid
from slam.layers import Layers

from ..figures.joining import joined
from ..figures.layer_cells import NAMES, palette, ranked
from ..figures.style import UNKNOWN

MAX_CELLS = 9_000_000  # of a picture; more are joined: a browser needs 8 bytes a cell
BELIEF_SHADES = 14  # from free to occupied; with the unknown 15, so that a pixel takes 4 bits
CLEAR = (0, 0, 0, 0)
REASONS = (  # by NO_REASON, SEEN_ONCE, SEEN_IN_PART, WENT_AWAY, DOOR_LEAF, GLASS
    (CLEAR, ""),
    ((150, 90, 230, 255), "kept, though one scan saw it"),
    ((90, 40, 170, 255), "kept, though some beams passed it"),
    ((213, 94, 0, 255), "left out: it was seen to go"),
    ((0, 114, 178, 255), "left out: the open leaf of a door"),
    ((0, 158, 115, 255), "kept: glass, which beams hit at a right angle only"),
)

Colour = tuple[int, ...]


class Picture(NamedTuple):
    """Cells with their colours.

    name     for the script
    label    for people
    spec     of the cells
    cells    (rows, cols) uint8, index of a colour
    colours  RGB or RGBA by index
    legend   (index, words) of the colours that have a meaning of their own
    """

    name: str
    label: str
    spec: GridSpec
    cells: np.ndarray
    colours: Sequence[Colour]
    legend: Sequence[tuple[int, str]]

    def as_dict(self) -> dict[str, Any]:
        """For the script: left, right, bottom, top in m, and a PNG whose first row is the top."""
        small = small_enough(cropped(self))
        return {
            "name": small.name,
            "label": small.label,
            "extent": [round(side, 4) for side in small.spec.extent],
            "cell": small.spec.resolution,
            "colours": [list(colour) for colour in small.colours],
            "legend": [[list(small.colours[k]), words] for k, words in small.legend],
            "png": _png(small),
        }


def map_picture(grid: OccupancyGrid) -> Picture:
    """What map.yaml holds."""
    cells = np.where(grid.solid, 2, grid.observed).astype(np.uint8)
    colours = [ImageColor.getrgb(UNKNOWN), (255, 255, 255), (0, 0, 0)]
    legend = [(2, "stands"), (1, "free"), (0, "never seen")]
    return Picture("map", "What stands (map.yaml)", grid.spec, cells, colours, legend)


def belief_picture(grid: OccupancyGrid) -> Picture:
    """What the SLAM believed at the end."""
    shade = 1 + np.rint((BELIEF_SHADES - 1) * np.clip(grid.occupied, 0.0, 1.0))
    cells = np.where(grid.observed, shade, 0).astype(np.uint8)
    greys = np.rint(np.linspace(255, 0, BELIEF_SHADES)).astype(int).tolist()
    colours = [ImageColor.getrgb(UNKNOWN), *((grey, grey, grey) for grey in greys)]
    legend = [(BELIEF_SHADES, "occupied"), (BELIEF_SHADES // 2, "perhaps"), (1, "free"),
              (0, "never seen")]  # fmt: skip
    return Picture("belief", "The SLAM's belief (belief.yaml)", grid.spec, cells, colours, legend)


def layers_picture(layers: Layers) -> Picture:
    """What always stands, what changes, what was kept."""
    colours = [ImageColor.getrgb(UNKNOWN), *map(tuple, palette().tolist()[1:])]
    return Picture("layers", "What changes (layers)", layers.spec, ranked(layers), colours,
                   list(NAMES.items()))  # fmt: skip


def reasons_picture(layers: Layers) -> Picture:
    """What was left out of map.yaml, or kept in doubt, and why; clear elsewhere."""
    legend = [(k, words) for k, (_, words) in enumerate(REASONS) if words]
    colours = [colour for colour, _ in REASONS]
    return Picture("reasons", "Left out or kept, and why", layers.spec, layers.reason, colours,
                   legend)  # fmt: skip


def cropped(picture: Picture) -> Picture:
    """The part with cells that are not of the first colour; one cell if there are none."""
    rows = np.flatnonzero(picture.cells.any(axis=1))
    cols = np.flatnonzero(picture.cells.any(axis=0))
    top, right = rows.max(initial=0) + 1, cols.max(initial=0) + 1
    row, col = rows.min(initial=top - 1), cols.min(initial=right - 1)
    spec = picture.spec._replace(
        row0=picture.spec.row0 + int(row), col0=picture.spec.col0 + int(col),
        rows=int(top - row), cols=int(right - col),
    )  # fmt: skip
    return picture._replace(spec=spec, cells=picture.cells[row:top, col:right])


def small_enough(picture: Picture) -> Picture:
    """The picture in cells joined by 2 x 2, 4 x 4, ..., so that it has about MAX_CELLS at most."""
    fold = 2 ** max(math.ceil(math.log2(max(picture.cells.size, 1) / MAX_CELLS) / 2), 0)
    spec, cells = joined(picture.spec, picture.cells, fold)
    return picture._replace(spec=spec, cells=cells)


def _png(picture: Picture) -> str:
    image = Image.fromarray(np.ascontiguousarray(picture.cells[::-1]), mode="P")
    image.putpalette([level for colour in picture.colours for level in colour[:3]])
    file = io.BytesIO()
    clear = [bytes(0 if len(c) > 3 and not c[3] else 255 for c in picture.colours)]
    more = {"transparency": clear[0]} if 0 in clear[0] else {}
    image.save(file, "PNG", compress_level=9, **more)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()
