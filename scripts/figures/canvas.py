"""A Pillow image that takes metres: fast enough to draw hundreds of frames."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageColor, ImageDraw, ImageFont
from scipy import ndimage

from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid

from .map_panel import Box, coarser
from .style import INK, PAPER, UNKNOWN

FINE = 2  # drawn this much larger than shown, and smoothed down
TITLE = 26  # pixels, strip above
ROBOT_RADIUS = 0.22  # m, Pioneer 3-DX
SMALLEST = 4.0  # pixels, radius of a robot in a large building
GREYS = np.round(np.linspace(0, 255, 8)).astype(int)  # of a map: fewer make a smaller file
PALETTE = [*np.repeat(GREYS, 3).tolist(), *ImageColor.getrgb(UNKNOWN)]


class MapCanvas:
    """The part `box` of the world, `width` pixels wide, below a strip of text."""

    def __init__(self, box: Box, width: int, image: Image.Image | None = None):
        self.box = box
        self.width = width
        self._scale = FINE * width / box.width
        height = round(box.height * self._scale / FINE) + TITLE
        self.image = image or Image.new("RGB", (FINE * width, FINE * height), PAPER)
        self._draw = ImageDraw.Draw(self.image)

    def copy(self) -> MapCanvas:
        """A canvas that begins as this one is."""
        return MapCanvas(self.box, self.width, self.image.copy())

    def finished(self) -> Image.Image:
        """The picture at its own size."""
        return self.image.reduce(FINE)

    def pixels(self, points: Array) -> list[tuple[float, float]]:
        """Points (n, 2), m, as pixels."""
        x = (points[:, 0] - self.box.left) * self._scale
        y = (self.box.top - points[:, 1]) * self._scale + TITLE * FINE
        return list(zip(x.tolist(), y.tolist(), strict=True))

    def lines(self, segments: Array, colour: str, width: float) -> None:
        """Segments (n, 4), m; `width` in pixels."""
        ends = self.pixels(segments.reshape(-1, 2))
        for start, stop in zip(ends[::2], ends[1::2], strict=True):
            self._draw.line([start, stop], fill=colour, width=round(width * FINE))

    def path(self, points: Array, colour: str, width: float) -> None:
        """A line through points (n, 2), m; `width` in pixels."""
        if len(points) > 1:
            self._draw.line(
                self.pixels(points), fill=colour, width=round(width * FINE), joint="curve"
            )

    def polygon(self, points: Array, colour: str) -> None:
        """A filled polygon (n, 2), m."""
        if len(points) > 2:
            self._draw.polygon(self.pixels(points), fill=colour)

    def dots(self, points: Array, colour: str, radius: float) -> None:
        """Discs at points (n, 2), m; `radius` in pixels."""
        for x, y in self.pixels(points):
            self._disc(x, y, radius * FINE, colour)

    def robot(self, pose: Pose2, colour: str) -> None:
        """A disc, with a line from its centre to its front."""
        radius = max(ROBOT_RADIUS, SMALLEST * FINE / self._scale)
        front = pose @ Pose2(radius, 0.0, 0.0)
        centre, tip = self.pixels(np.array([pose[:2], front[:2]]))
        self._disc(centre[0], centre[1], radius * self._scale, colour)
        self._draw.line([centre, tip], fill=PAPER, width=2 * FINE)

    def ring(self, pose: Pose2, colour: str) -> None:
        """The outline of a robot."""
        ((x, y),) = self.pixels(np.array([pose[:2]]))
        r = ROBOT_RADIUS * self._scale
        self._draw.ellipse((x - r, y - r, x + r, y + r), outline=colour, width=2 * FINE)

    def grid(self, grid: OccupancyGrid) -> None:
        """A map, all over."""
        left, _, _, top = grid.spec.extent
        x0, y0 = self.pixels(np.array([(left, top)]))[0]
        size = self.image.width, self.image.height - TITLE * FINE
        grid = coarser(grid, 1 / self._scale)
        step = 1 / (self._scale * grid.spec.resolution)  # cells a pixel
        inverse = (step, 0.0, -x0 * step, 0.0, step, (TITLE * FINE - y0) * step)
        cells = Image.fromarray(few_shades(grid)[::-1])
        cells.putpalette(PALETTE)
        area = cells.transform(size, Image.Transform.AFFINE, inverse, fillcolor=len(GREYS))
        self.image.paste(area.convert("RGB"), (0, TITLE * FINE))

    def shade_behind(self, walls: Array, inside: Pose2, colour: str) -> None:
        """Fill all that is not reached from `inside` without crossing a wall."""
        barrier = MapCanvas(self.box, self.width)
        barrier.lines(walls, INK, 2)
        free = np.asarray(barrier.image)[:, :, 0] > 128
        regions = np.empty(free.shape, dtype=np.int32)
        ndimage.label(free, output=regions)
        ((x, y),) = self.pixels(np.array([inside[:2]]))
        behind = free & (regions != regions[int(y), int(x)])
        behind[: TITLE * FINE] = False
        self.image.paste(colour, (0, 0), Image.fromarray(behind))

    def title(self, pieces: Sequence[tuple[str, str]]) -> None:
        """Pieces of (text, colour), in the strip above; on the right those after an empty one."""
        self._draw.rectangle((0, 0, self.image.width, TITLE * FINE - 1), fill=PAPER)
        texts = [text for text, _ in pieces]
        split = texts.index("") if "" in texts else len(pieces)
        self._write(pieces[:split], 8.0 * FINE)
        right = pieces[split + 1 :]
        self._write(right, self.image.width - 8 * FINE - sum(_length(text) for text, _ in right))

    def _write(self, pieces: Sequence[tuple[str, str]], x: float) -> None:
        for text, colour in pieces:
            self._draw.text((x, TITLE * FINE / 2), text, colour, _font(), anchor="lm")
            x += _length(text)

    def _disc(self, x: float, y: float, r: float, colour: str) -> None:
        self._draw.ellipse((x - r, y - r, x + r, y + r), fill=colour)


def fan(pose: Pose2, ranges: Array, angles: Array) -> Array:
    """(n + 1, 2) the sensor and the ends of its beams, m, in the world."""
    directions = np.column_stack([np.cos(angles + pose.theta), np.sin(angles + pose.theta)])
    return np.vstack([pose[:2], directions * ranges[:, None] + pose[:2]])


def few_shades(grid: OccupancyGrid) -> np.ndarray:
    """(rows, cols) uint8 which colour of PALETTE a cell has: its last where nothing was seen."""
    nearest = np.abs(np.arange(256)[:, None] - GREYS).argmin(axis=1).astype(np.uint8)
    shade = nearest[np.round(255 * (1.0 - np.clip(grid.occupied, 0.0, 1.0))).astype(np.uint8)]
    shade[~grid.observed] = len(GREYS)
    return shade


def _length(text: str) -> float:
    return math.ceil(_font().getlength(text))


@functools.cache
def _font() -> ImageFont.FreeTypeFont:
    """DejaVu Sans, which comes with matplotlib: the same on every machine."""
    file = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(str(file), 13 * FINE)
