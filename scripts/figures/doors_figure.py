"""The doors found, each with what is around it in the layers: to judge them by eye."""

from __future__ import annotations

import math
from collections.abc import Sequence

import matplotlib.font_manager
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from slam.layers import Layers
from slam.layers.doors import MappedDoor

from .layer_cells import palette, ranked
from .layers_figure import PERHAPS_COLOUR, SURE_COLOUR
from .style import INK, PAPER

SIDE, COLUMNS, MAX_DOORS = 4.0, 6, 60  # m of the square around a door; doors in a row; at most
PANEL, TITLE, GAP = 200, 34, 8  # pixels
TEXT_SIZE, LINE = 12, 3  # pixels


def doors_picture(layers: Layers) -> Image.Image:
    """A square of SIDE around each of the doors, with its number, probability and looks."""
    doors = layers.doors[:MAX_DOORS]
    columns = max(min(COLUMNS, len(doors)), 1)
    rows = max(math.ceil(len(doors) / columns), 1)
    width, height = PANEL + GAP, PANEL + TITLE + GAP
    image = Image.new("RGB", (columns * width + GAP, rows * height + GAP), PAPER)
    pen, cells = ImageDraw.Draw(image), palette()[ranked(layers)]
    font = ImageFont.truetype(matplotlib.font_manager.findfont("DejaVu Sans"), TEXT_SIZE)
    for number, door in enumerate(doors):
        x, y = GAP + number % columns * width, GAP + number // columns * height
        image.paste(_around(door, layers, cells), (x, y + TITLE))
        ends = [(x + u, y + TITLE + v) for u, v in _pixels(door.ends, door)]
        pen.line(ends, fill=SURE_COLOUR if door.sure else PERHAPS_COLOUR, width=LINE)
        pen.rectangle((x, y + TITLE, x + PANEL - 1, y + TITLE + PANEL - 1), outline=INK)
        pen.multiline_text((x, y), _title(number + 1, door), fill=INK, font=font, spacing=2)
    return image


def _title(number: int, door: MappedDoor) -> str:
    percent = min(round(100 * door.probability), 99)
    seen = f"seen open {door.seen_open}, closed {door.seen_closed}"
    return f"{number}: {percent} %, {door.width:.2f} m wide\n{seen}"


def _around(door: MappedDoor, layers: Layers, cells: np.ndarray) -> Image.Image:
    """The layers around a door, PANEL x PANEL pixels, what is above on top."""
    spec = layers.spec
    offsets = (np.arange(PANEL) + 0.5) * SIDE / PANEL - SIDE / 2
    x, y = door.ends.mean(axis=0)
    rows, cols = spec.cells(np.column_stack([x + offsets, y + offsets])).T
    rows, cols = rows[::-1, None], cols[None]
    inside = (rows >= 0) & (rows < spec.rows) & (cols >= 0) & (cols < spec.cols)
    shown = cells[np.clip(rows, 0, spec.rows - 1), np.clip(cols, 0, spec.cols - 1)]
    return Image.fromarray(np.where(inside[..., None], shown, palette()[0]).astype(np.uint8))


def _pixels(points: np.ndarray, door: MappedDoor) -> Sequence[tuple[float, float]]:
    away = (points - door.ends.mean(axis=0)) * PANEL / SIDE
    return [(PANEL / 2 + u, PANEL / 2 - v) for u, v in away.tolist()]
