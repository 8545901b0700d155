"""Canvas: a pygame surface in world coordinates, with supersampling.

Lines have the same width in pixels at any zoom. pygame is imported on first use.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dynslam_env.drawing.colours import (
    BEAM,
    FAINT,
    GREEN,
    INK,
    LIT,
    PAPER,
    PURPLE,
    SOLID,
    UNKNOWN,
    Colour,
)
from dynslam_env.drawing.free_space import FreeSpace
from dynslam_env.drawing.view import Projection
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.scan import Scan

if TYPE_CHECKING:
    import pygame

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # keep standard output clean

SUPERSAMPLING = 4  # factor of supersampling, a power of two: others darken white when smoothed
MIN_RANGE_STEP = 0.3  # of a range; neighbours that differ by more are at a corner


class Canvas:
    """A surface in world coordinates, m: x to the right, y up; line widths in pixels shown.

    size           (width, height), pixels shown
    supersampling  factor, a power of two
    """

    def __init__(self, size: tuple[int, int], supersampling: int = SUPERSAMPLING):
        import pygame

        self.size, self._supersampling = size, supersampling
        self._surface = pygame.Surface((size[0] * supersampling, size[1] * supersampling))
        self._world = Projection(0.0, 0.0, 1.0)

    def clear(self, projection: Projection, colour: Colour) -> None:
        """Fill with `colour`, and set the part of the world shown."""
        self._world = projection._replace(scale=projection.scale * self._supersampling)
        self._surface.fill(colour)

    def shown(self) -> pygame.Surface:
        """The picture in the size shown, with smooth edges."""
        import pygame

        return pygame.transform.smoothscale(self._surface, self.size)

    # -- objects -------------------------------------------------------------------------------

    def floor(self, free: FreeSpace) -> None:
        """The free space, on a solid background."""
        if free.outer is None:
            self._surface.fill(PAPER)
        else:
            self._fill(free.outer, PAPER)
        for hole in free.holes:
            self._fill(hole, SOLID)

    def lines(self, segments: Array, colour: Colour, width: float) -> None:
        """Segments (n, 4), m, with round ends."""
        import pygame

        thick = round(width * self._supersampling)
        ends = self._pixels(segments.reshape(-1, 2))
        for a, b in zip(ends[::2], ends[1::2], strict=True):
            pygame.draw.line(self._surface, colour, a, b, thick)
        if thick > 2:
            for end in ends:
                pygame.draw.circle(self._surface, colour, end, thick / 2)

    def leaf(self, corners: Array, colour: Colour) -> None:
        """A door leaf (4, 2), m, drawn slightly thicker so that a thin one is visible."""
        import pygame

        self._fill(corners, colour)
        points = self._pixels(corners)
        pygame.draw.lines(self._surface, colour, True, points, 2 * self._supersampling)
        for point in points:
            pygame.draw.circle(self._surface, colour, point, self._supersampling)

    def sweep(self, sweep: Array, width: float) -> None:
        """The dashed arc of the free edge of a door of that width, m."""
        import pygame

        x, y, closed, opening = sweep.tolist()
        steps = np.linspace(0.0, opening, 26) + closed
        arc = np.column_stack([x + width * np.cos(steps), y + width * np.sin(steps)])
        points = self._pixels(arc)
        for start, stop in zip(points[::2], points[1::2], strict=True):
            pygame.draw.line(self._surface, FAINT, start, stop, self._supersampling)

    def fan(self, sensor: Pose2, scan: Scan) -> None:
        """The area that the beams cover, and some of the beams."""
        import pygame

        heard = ~np.isnan(scan.ranges)
        angles, ranges = scan.angles[heard], np.minimum(scan.ranges[heard], scan.max_range)
        origin = self._world.at(sensor.x, sensor.y)
        if len(ranges) > 1:
            rim = self._pixels(_ends(sensor, *_stepped(angles, ranges)))
            pygame.draw.polygon(self._surface, LIT, [origin, *rim])
        every = max(1, len(ranges) // 60)
        for point in self._pixels(_ends(sensor, angles[::every], ranges[::every])):
            pygame.draw.line(self._surface, BEAM, origin, point, max(1, self._supersampling // 2))

    def echoes(self, sensor: Pose2, scan: Scan) -> None:
        """A dot at each echo."""
        import pygame

        size = self._supersampling * self._dot(0.03, 1.3, 3.0)
        for point in self._pixels(_ends(sensor, scan.angles[scan.hit], scan.ranges[scan.hit])):
            pygame.draw.circle(self._surface, GREEN, point, size)

    def trail(self, poses: Sequence[Pose2], colour: Colour) -> None:
        """A line through poses."""
        import pygame

        if len(poses) > 1:
            points = self._pixels(np.array(poses)[:, :2])
            pygame.draw.lines(self._surface, colour, False, points, 2 * self._supersampling)

    def robot(self, pose: Pose2, radius: float, colour: Colour, filled: bool = True) -> None:
        """A disc, or a ring, with a line from its centre to its front."""
        import pygame

        centre = self._world.at(pose.x, pose.y)
        size = self._supersampling * self._dot(radius, 5.0, math.inf)
        front = centre[0] + size * math.cos(pose.theta), centre[1] - size * math.sin(pose.theta)
        if filled:
            pygame.draw.circle(self._surface, PAPER, centre, size + self._supersampling)
            pygame.draw.circle(self._surface, colour, centre, size)
        else:
            pygame.draw.circle(
                self._surface,
                colour,
                centre,
                size + 2 * self._supersampling,
                2 * self._supersampling,
            )
        pygame.draw.line(
            self._surface, PAPER if filled else colour, centre, front, 2 * self._supersampling
        )

    def person(self, x: float, y: float, radius: float) -> None:
        """A person from above: a disc with a head, m."""
        import pygame

        centre, size = self._world.at(x, y), self._supersampling * self._dot(radius, 4.0, math.inf)
        pygame.draw.circle(self._surface, INK, centre, size + self._supersampling)
        pygame.draw.circle(self._surface, PURPLE, centre, size)
        pygame.draw.circle(self._surface, INK, centre, size * 0.4)

    def grid(self, grid: OccupancyGrid) -> None:
        """A map: white free, black occupied, grey unknown."""
        import pygame

        spec = grid.spec
        cell = spec.resolution
        width, height = self._surface.get_size()
        corners = np.array([(0.0, height), (float(width), 0.0)]) / (1, -1) / self._world.scale
        seen = spec.cells(corners + (self._world.left, self._world.top))
        (row0, col0), (row1, col1) = np.clip(seen + ((0, 0), (1, 1)), 0, spec.shape).tolist()
        if row0 >= row1 or col0 >= col1:
            return
        part = slice(row0, row1), slice(col0, col1)
        shade = (255 * (1.0 - np.clip(grid.occupied[part], 0.0, 1.0))).astype(np.uint8)
        image = np.repeat(shade[:, :, None], 3, axis=2)
        image[~grid.observed[part]] = UNKNOWN
        x, y = spec.origin
        left, bottom = self._world.at(x + col0 * cell, y + row0 * cell)
        right, top = self._world.at(x + col1 * cell, y + row1 * cell)
        at = round(left), round(top)
        size = round(right) - at[0], round(bottom) - at[1]
        cells = pygame.surfarray.make_surface(image[::-1].swapaxes(0, 1)).convert(self._surface)
        self._surface.blit(pygame.transform.scale(cells, size), at)

    # -- pixels --------------------------------------------------------------------------------

    def _pixels(self, points: Array) -> list[list[float]]:
        return self._world.points(points).tolist()

    def _fill(self, corners: Array, colour: Colour) -> None:
        import pygame

        if len(corners) > 2:
            pygame.draw.polygon(self._surface, colour, self._pixels(corners))

    def _dot(self, metres: float, least: float, most: float) -> float:
        """Radius in pixels shown, limited so that it is visible at any zoom."""
        return min(max(metres * self._world.scale / self._supersampling, least), most)


def _ends(sensor: Pose2, angles: Array, ranges: Array) -> Array:
    """(beams, 2) end points of beams, m, world."""
    headings = angles + sensor.theta
    ends = np.column_stack([np.cos(headings), np.sin(headings)]) * ranges[:, None]
    return ends + (sensor.x, sensor.y)


def _stepped(angles: Array, ranges: Array) -> tuple[Array, Array]:
    """Angles and ranges with a step halfway between beams of very different range."""
    before = np.flatnonzero(
        np.abs(np.diff(ranges)) > MIN_RANGE_STEP * np.minimum(ranges[1:], ranges[:-1])
    )
    at, half = np.repeat(before + 1, 2), (angles[before] + angles[before + 1]) / 2
    edges = np.column_stack([ranges[before], ranges[before + 1]]).ravel()
    return np.insert(angles, at, np.repeat(half, 2)), np.insert(ranges, at, edges)
