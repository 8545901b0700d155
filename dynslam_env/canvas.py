"""Canvas: a pygame surface that takes metres, drawn larger than it is shown and smoothed down.

Colours: Okabe and Ito (2008), told apart by any eyes. pygame is imported when first needed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.scan import Scan

if TYPE_CHECKING:
    import pygame

PIXELS_PER_METRE = 60
FINE = 2  # drawn this much larger than shown
TITLE = 30  # pixels, strip above a panel
BORDER = 0.35  # m around the world

PAPER, SOLID, FACE, INK = (255, 255, 255), (222, 224, 228), (60, 64, 72), (40, 42, 48)
FAINT = (176, 180, 188)
BLUE, VERMILION, ORANGE, SKY = (0, 114, 178), (213, 94, 0), (230, 159, 0), (86, 180, 233)


class Canvas:
    """A surface that takes metres. x to the right, y up."""

    def __init__(self, walls: Array, surface: pygame.Surface | None = None):
        import pygame

        ends = walls.reshape(-1, 2)
        self._low, self._high = ends.min(axis=0) - BORDER, ends.max(axis=0) + BORDER
        self._scale = PIXELS_PER_METRE * FINE
        width, height = np.ceil((self._high - self._low) * PIXELS_PER_METRE / 2).astype(int) * 2
        if surface is None:
            surface = pygame.Surface((int(width) * FINE, (int(height) + TITLE) * FINE))
            surface.fill(PAPER)
        self.surface = surface

    def at(self, x: float, y: float) -> tuple[int, int]:
        """The pixel of a point, m."""
        right, up = (x - self._low[0]) * self._scale, (self._high[1] - y) * self._scale
        return int(right), int(up) + TITLE * FINE

    def lines(self, segments: Array, colour: tuple[int, int, int], width: int) -> None:
        """Segments (n, 4), m, with round ends; `width` in pixels."""
        import pygame

        for x1, y1, x2, y2 in segments.tolist():
            a, b = self.at(x1, y1), self.at(x2, y2)
            pygame.draw.line(self.surface, colour, a, b, width)
            for end in (a, b):
                pygame.draw.circle(self.surface, colour, end, width // 2)

    def polygon(self, corners: Array, colour: tuple[int, int, int]) -> None:
        """A filled polygon (n, 2), m, a little fatter than it is, so that a thin one shows."""
        import pygame

        points = [self.at(x, y) for x, y in corners.tolist()]
        pygame.draw.polygon(self.surface, colour, points)
        pygame.draw.lines(self.surface, colour, True, points, FINE * 2)

    def sweep(self, x: float, y: float, closed: float, opening: float, width: float) -> None:
        """The dashed arc that the free edge of a door describes."""
        import pygame

        steps = np.linspace(0.0, opening, 25) + closed
        points = [self.at(x + width * math.cos(a), y + width * math.sin(a)) for a in steps]
        for start, stop in zip(points[::2], points[1::2], strict=False):
            pygame.draw.line(self.surface, FAINT, start, stop, FINE)

    def fan(self, sensor: Pose2, scan: Scan) -> None:
        """The beams as a translucent area, and a dot at every echo."""
        import pygame

        ranges = np.nan_to_num(scan.ranges, nan=0.0, posinf=scan.max_range)
        angles = scan.angles + sensor.theta
        ends = np.column_stack([np.cos(angles), np.sin(angles)]) * ranges[:, None]
        points = [self.at(sensor.x + x, sensor.y + y) for x, y in ends.tolist()]
        origin = self.at(sensor.x, sensor.y)
        layer = pygame.Surface(self.surface.get_size(), pygame.SRCALPHA)
        if len(points) > 1:
            pygame.draw.polygon(layer, (*SKY, 60), [origin, *points])
        for point in points[:: max(1, len(points) // 60)]:
            pygame.draw.line(layer, (*SKY, 110), origin, point, 1)
        self.surface.blit(layer, (0, 0))
        for point, hit in zip(points, scan.hit.tolist(), strict=True):
            if hit:
                pygame.draw.circle(self.surface, VERMILION, point, 2 * FINE)

    def trail(self, poses: Sequence[Pose2], colour: tuple[int, int, int]) -> None:
        """A line through poses."""
        import pygame

        if len(poses) > 1:
            points = [self.at(pose.x, pose.y) for pose in poses]
            pygame.draw.lines(self.surface, colour, False, points, FINE + 1)

    def robot(
        self, pose: Pose2, radius: float, colour: tuple[int, int, int], filled: bool = True
    ) -> None:
        """A disc, or a ring, with a line from its centre to its front."""
        import pygame

        centre, size = self.at(pose.x, pose.y), round(radius * self._scale)
        front = pose @ Pose2(radius, 0.0, 0.0)
        if filled:
            pygame.draw.circle(self.surface, colour, centre, size)
            pygame.draw.circle(self.surface, PAPER, centre, size, FINE)
        else:
            pygame.draw.circle(self.surface, colour, centre, size, FINE * 2)
        line = PAPER if filled else colour
        pygame.draw.line(self.surface, line, centre, self.at(front.x, front.y), FINE * 2)

    def grid(self, grid: OccupancyGrid) -> None:
        """A map: white free, black occupied, grey unknown."""
        import pygame

        shade = (255 * (1.0 - np.clip(grid.occupied, 0.0, 1.0))).astype(np.uint8)
        image = np.repeat(shade[:, :, None], 3, axis=2)
        image[~grid.observed] = SOLID
        left, right, bottom, top = grid.spec.extent
        low, high = self.at(left, top), self.at(right, bottom)
        cells = pygame.surfarray.make_surface(image[::-1].swapaxes(0, 1))
        size = high[0] - low[0], high[1] - low[1]
        self.surface.fill(SOLID, (0, TITLE * FINE, *self.surface.get_size()))
        self.surface.blit(pygame.transform.scale(cells, size), low)

    def title(self, text: str) -> None:
        """A line of text above."""
        self.surface.fill(PAPER, (0, 0, self.surface.get_width(), TITLE * FINE))
        self._text(text, (10 * FINE, 8 * FINE), 20)

    def scale_bar(self) -> None:
        """One metre, at the upper right."""
        import pygame

        right, y = self.surface.get_width() - 12 * FINE, 15 * FINE
        left = right - self._scale
        pygame.draw.line(self.surface, INK, (left, y), (right, y), FINE * 2)
        for x in (left, right):
            pygame.draw.line(self.surface, INK, (x, y - 4 * FINE), (x, y + 4 * FINE), FINE * 2)
        self._text("1 m", (left - 30 * FINE, 8 * FINE), 20)

    def _text(self, text: str, at: tuple[int, int], size: int) -> None:
        import pygame

        pygame.font.init()
        font = pygame.font.Font(None, size * FINE)
        self.surface.blit(font.render(text, True, INK), at)
