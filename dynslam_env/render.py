"""The picture: the world with robot, doors and beams, and beside it what a SLAM believes.

Drawn at twice the size and smoothed down. Colours: Okabe and Ito (2008), told apart by any eyes.
pygame is imported when something is drawn for the first time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

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


class Scene(NamedTuple):
    """The truth to be drawn.

    walls    (w, 4) m
    leaves   (d, 4, 4) edges of the door leaves as they stand, m
    sweeps   (d, 4) hinge x, y in m, closed direction and opening angle (with its sign) in rad
    scan     the last one
    pose     of the robot
    radius   of the robot, m
    trail    poses so far
    title    a line of text
    """

    walls: Array
    leaves: Array
    sweeps: Array
    scan: Scan
    pose: Pose2
    radius: float
    trail: Sequence[Pose2]
    title: str


class Belief(NamedTuple):
    """What a SLAM believes: its map, the robot's pose and its trail in it, a line of text."""

    grid: OccupancyGrid
    pose: Pose2
    trail: Sequence[Pose2]
    title: str


class Viewer:
    """Draws scenes into an array, or into a window if `window`, at most `fps` of them a second."""

    def __init__(self, window: bool, fps: int):
        self._window, self._fps = window, fps
        self._screen: pygame.Surface | None = None
        self._floor: tuple[Array, pygame.Surface] | None = None
        self._clock: Any = None

    def draw(self, scene: Scene, belief: Belief | None) -> NDArray[np.uint8] | None:
        """The picture (rows, columns, 3), or None if it went to the window."""
        import pygame

        panels = [self._truth(scene)]
        if belief is not None:
            panels.append(_belief_panel(scene, belief))
        height = panels[0].get_height()
        picture = pygame.Surface((sum(panel.get_width() for panel in panels), height))
        x = 0
        for panel in panels:
            picture.blit(panel, (x, 0))
            pygame.draw.line(picture, FAINT, (x, 0), (x, height), FINE)
            x += panel.get_width()
        small = pygame.transform.smoothscale(picture, (x // FINE, height // FINE))
        if self._window:
            self._show(small)
            return None
        return np.ascontiguousarray(pygame.surfarray.array3d(small).swapaxes(0, 1))

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._screen is not None:
            import pygame

            pygame.display.quit()
            self._screen = None

    def _show(self, picture: pygame.Surface) -> None:
        import pygame

        if self._screen is None or self._screen.get_size() != picture.get_size():
            pygame.display.init()
            pygame.display.set_caption("dynslam")
            self._screen = pygame.display.set_mode(picture.get_size())
            self._clock = pygame.time.Clock()
        self._screen.blit(picture, (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self._fps)

    def _truth(self, scene: Scene) -> pygame.Surface:
        if self._floor is None or self._floor[0] is not scene.walls:
            self._floor = scene.walls, _floor_plan(scene)
        canvas = Canvas(scene.walls, self._floor[1].copy())
        canvas.fan(scene.pose @ scene.scan.mount, scene.scan)
        for sweep, leaf in zip(scene.sweeps, scene.leaves, strict=True):
            x, y, closed, opening = sweep.tolist()
            canvas.sweep(x, y, closed, opening, math.dist(leaf[0, :2], leaf[0, 2:]))
            canvas.polygon(leaf[:, :2], ORANGE)
        canvas.trail(scene.trail, BLUE)
        canvas.robot(scene.pose, scene.radius, BLUE)
        canvas.title(scene.title)
        canvas.scale_bar()
        return canvas.surface


def _belief_panel(scene: Scene, belief: Belief) -> pygame.Surface:
    canvas = Canvas(scene.walls)
    canvas.grid(belief.grid)
    canvas.lines(scene.walls, SKY, FINE)
    canvas.trail(scene.trail, BLUE)
    canvas.trail(belief.trail, VERMILION)
    canvas.robot(scene.pose, scene.radius, BLUE, filled=False)
    canvas.robot(belief.pose, scene.radius, VERMILION)
    canvas.title(belief.title)
    return canvas.surface


def _floor_plan(scene: Scene) -> pygame.Surface:
    """Walls as faces of solids: whatever cannot be reached from the robot is solid."""
    import pygame
    from scipy import ndimage

    canvas = Canvas(scene.walls)
    canvas.lines(scene.walls, FACE, 5)
    pixels = pygame.surfarray.pixels3d(canvas.surface)
    regions = np.empty(pixels.shape[:2], dtype=np.int32)
    ndimage.label(pixels[:, :, 0] == PAPER[0], output=regions)
    inside = regions == regions[canvas.at(scene.pose.x, scene.pose.y)]
    pixels[(regions > 0) & ~inside] = SOLID
    del pixels  # unlocks the surface
    return canvas.surface


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
