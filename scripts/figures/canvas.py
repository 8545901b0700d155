"""Drawing in metres on a Pillow image: fast enough for films of hundreds of frames."""

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

SUPERSAMPLING = 2  # drawn larger by this factor, then reduced, for smooth lines
TITLE_HEIGHT, LABEL_HEIGHT = 26, 22  # pixels
ROBOT_RADIUS = 0.22  # m, Pioneer 3-DX
MIN_ROBOT_PIXELS = 4.0  # radius in a large building
GREYS = np.round(np.linspace(0, 255, 8)).astype(int)  # of maps: few, for small files
PALETTE = [*np.repeat(GREYS, 3).tolist(), *ImageColor.getrgb(UNKNOWN)]


class MapCanvas:
    """A picture of the part `box` of the world, `width` pixels wide, below a line of text."""

    def __init__(self, box: Box, width: int, image: Image.Image | None = None):
        self.box = box
        self.width = width
        self._scale = SUPERSAMPLING * width / box.width
        height = round(box.height * self._scale / SUPERSAMPLING) + TITLE_HEIGHT
        self.image = image or Image.new(
            "RGB", (SUPERSAMPLING * width, SUPERSAMPLING * height), PAPER
        )
        self._draw = ImageDraw.Draw(self.image)

    def copy(self) -> MapCanvas:
        """A copy of this canvas."""
        return MapCanvas(self.box, self.width, self.image.copy())

    def finished(self) -> Image.Image:
        """The picture at its final size."""
        return self.image.reduce(SUPERSAMPLING)

    def pixels(self, points: Array) -> list[tuple[float, float]]:
        """Pixel coordinates of points (n, 2), m."""
        x = (points[:, 0] - self.box.left) * self._scale
        y = (self.box.top - points[:, 1]) * self._scale + TITLE_HEIGHT * SUPERSAMPLING
        return list(zip(x.tolist(), y.tolist(), strict=True))

    def lines(self, segments: Array, colour: str, width: float) -> None:
        """Draw segments (n, 4), m; `width` in pixels."""
        ends = self.pixels(segments.reshape(-1, 2))
        for start, stop in zip(ends[::2], ends[1::2], strict=True):
            self._draw.line([start, stop], fill=colour, width=round(width * SUPERSAMPLING))

    def path(self, points: Array, colour: str, width: float) -> None:
        """Draw a line through points (n, 2), m; `width` in pixels."""
        if len(points) > 1:
            self._draw.line(
                self.pixels(points), fill=colour, width=round(width * SUPERSAMPLING), joint="curve"
            )

    def polygon(self, points: Array, colour: str) -> None:
        """Fill a polygon (n, 2), m."""
        if len(points) > 2:
            self._draw.polygon(self.pixels(points), fill=colour)

    def dots(self, points: Array, colour: str, radius: float) -> None:
        """Draw discs at points (n, 2), m; `radius` in pixels."""
        for x, y in self.pixels(points):
            self._disc(x, y, radius * SUPERSAMPLING, colour)

    def robot(self, pose: Pose2, colour: str) -> None:
        """Draw a disc with a line from its centre to its front."""
        radius = max(ROBOT_RADIUS, MIN_ROBOT_PIXELS * SUPERSAMPLING / self._scale)
        front = pose @ Pose2(radius, 0.0, 0.0)
        centre, tip = self.pixels(np.array([pose[:2], front[:2]]))
        self._disc(centre[0], centre[1], radius * self._scale, colour)
        self._draw.line([centre, tip], fill=PAPER, width=2 * SUPERSAMPLING)

    def ring(self, pose: Pose2, colour: str) -> None:
        """Draw the outline of a robot."""
        ((x, y),) = self.pixels(np.array([pose[:2]]))
        r = ROBOT_RADIUS * self._scale
        self._draw.ellipse((x - r, y - r, x + r, y + r), outline=colour, width=2 * SUPERSAMPLING)

    def grid(self, grid: OccupancyGrid) -> None:
        """Draw a map; it covers everything drawn before."""
        left, _, _, top = grid.spec.extent
        x0, y0 = self.pixels(np.array([(left, top)]))[0]
        size = self.image.width, self.image.height - TITLE_HEIGHT * SUPERSAMPLING
        grid = coarser(grid, SUPERSAMPLING / self._scale)  # of a pixel of the finished picture
        step = 1 / (self._scale * grid.spec.resolution)  # cells a pixel
        inverse = (step, 0.0, -x0 * step, 0.0, step, (TITLE_HEIGHT * SUPERSAMPLING - y0) * step)
        cells = Image.fromarray(few_shades(grid)[::-1])
        cells.putpalette(PALETTE)
        area = cells.transform(size, Image.Transform.AFFINE, inverse, fillcolor=len(GREYS))
        self.image.paste(area.convert("RGB"), (0, TITLE_HEIGHT * SUPERSAMPLING))

    def shade_behind(self, walls: Array, inside: Pose2, colour: str) -> None:
        """Fill everything that cannot be reached from `inside` without crossing a wall."""
        barrier = MapCanvas(self.box, self.width)
        barrier.lines(walls, INK, 2)
        free = np.asarray(barrier.image)[:, :, 0] > 128
        regions = np.empty(free.shape, dtype=np.int32)
        ndimage.label(free, output=regions)
        ((x, y),) = self.pixels(np.array([inside[:2]]))
        behind = free & (regions != regions[int(y), int(x)])
        behind[: TITLE_HEIGHT * SUPERSAMPLING] = False
        self.image.paste(colour, (0, 0), Image.fromarray(behind))

    def title(self, pieces: Sequence[tuple[str, str]]) -> None:
        """Write pieces of (text, colour) above the picture; right-aligned after an empty piece."""
        self._draw.rectangle((0, 0, self.image.width, TITLE_HEIGHT * SUPERSAMPLING - 1), fill=PAPER)
        texts = [text for text, _ in pieces]
        split = texts.index("") if "" in texts else len(pieces)
        self._write(pieces[:split], 8.0 * SUPERSAMPLING)
        right = pieces[split + 1 :]
        self._write(
            right, self.image.width - 8 * SUPERSAMPLING - sum(_length(text) for text, _ in right)
        )

    def label(self, text: str, colour: str) -> None:
        """Write on a box of `colour` in the upper left corner of the picture."""
        left, top = 8 * SUPERSAMPLING, (TITLE_HEIGHT + 8) * SUPERSAMPLING
        right, bottom = (
            left + _length(text) + 16 * SUPERSAMPLING,
            top + LABEL_HEIGHT * SUPERSAMPLING,
        )
        self._draw.rectangle((left, top, right, bottom), fill=colour)
        self._draw.text(((left + right) / 2, (top + bottom) / 2), text, PAPER, _font(), anchor="mm")

    def _write(self, pieces: Sequence[tuple[str, str]], x: float) -> None:
        for text, colour in pieces:
            self._draw.text(
                (x, TITLE_HEIGHT * SUPERSAMPLING / 2), text, colour, _font(), anchor="lm"
            )
            x += _length(text)

    def _disc(self, x: float, y: float, r: float, colour: str) -> None:
        self._draw.ellipse((x - r, y - r, x + r, y + r), fill=colour)


def fan(pose: Pose2, ranges: Array, angles: Array) -> Array:
    """(n + 1, 2) positions of the sensor and of the ends of its beams in the world, m."""
    directions = np.column_stack([np.cos(angles + pose.theta), np.sin(angles + pose.theta)])
    return np.vstack([pose[:2], directions * ranges[:, None] + pose[:2]])


def few_shades(grid: OccupancyGrid) -> np.ndarray:
    """(rows, cols) uint8 index into PALETTE; its last colour marks unobserved cells."""
    nearest = np.abs(np.arange(256)[:, None] - GREYS).argmin(axis=1).astype(np.uint8)
    shade = nearest[np.round(255 * (1.0 - np.clip(grid.occupied, 0.0, 1.0))).astype(np.uint8)]
    shade[~grid.observed] = len(GREYS)
    return shade


def _length(text: str) -> float:
    return math.ceil(_font().getlength(text))


@functools.cache
def _font() -> ImageFont.FreeTypeFont:
    """DejaVu Sans of matplotlib, the same on every machine."""
    file = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(str(file), 13 * SUPERSAMPLING)
