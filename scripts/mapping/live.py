"""A window that shows a running SLAM: map, path, scan, confidence ellipse, time left."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from PIL import ImageColor

from dynslam_env.drawing import captions, colours
from dynslam_env.drawing.view import Projection
from slam.geometry import Array, Pose2, transform_points
from slam.grid import OccupancyGrid
from slam.interface import Estimate, Slam, believed
from slam.layers.doors import MappedDoor
from slam.metrics.lost import ALARM_LEVEL
from slam.scan import Scan

from ..console.window import open_window
from ..figures import style
from ..figures.canvas import MIN_ROBOT_PIXELS, PALETTE, ROBOT_RADIUS, few_shades
from ..figures.ellipse import outline
from ..figures.lost_course import stretches
from ..figures.map_panel import Box, MapPanel, coarser

if TYPE_CHECKING:
    import pygame

WINDOW_SIZE = (1000, 800)  # pixels; less on a smaller display
STATUS_HEIGHT = 30  # pixels, the line below
LOST, LOST_PATH_WIDTH = ImageColor.getrgb(style.LOST)[:3], 4  # pixels
MIN_FRAME_TIME, MIN_MAP_TIME = 1 / 15, 0.5  # s between two pictures, between two maps
MAX_TIME_SHARE = 0.06  # of the run that pictures may take, and maps again
MAX_HOLD = 60.0  # s for which the window stays open when all is written
MIN_WAIT = 0.05  # s between two looks at the keyboard and the mouse
DOOR_WIDTH = 4  # pixels
MARGIN_SHARE = 0.1  # of the map's size, around it, as it grows
INSTEAD = "leave out --live, and look at the film afterwards (--film)"


class Live:
    """An open window. Closing it does not stop the run.

    title  of the window
    clock  s, wall time

    wait   sleeps for as many seconds as it is told

    Draws at most 15 pictures and 2 new maps per second, and fewer where that would
    take more than `MAX_TIME_SHARE` of the time. Raises InputError if there is no display.
    """

    def __init__(
        self,
        title: str,
        clock: Callable[[], float] = time.perf_counter,
        wait: Callable[[float], None] = time.sleep,
    ):
        self._screen = open_window(f"dynslam: {title}", WINDOW_SIZE, "--live", INSTEAD)
        self._clock, self._wait, self._began = clock, wait, clock()
        self._next_frame = self._next_map = self._began
        self._poses: list[Pose2] = []
        self._lost: list[bool] = []  # whether the robot was lost, at each of them
        self._background: pygame.Surface | None = None
        self._view = Projection(0.0, 0.0, 1.0)
        self._drawn = 0  # poses whose path is in the background
        self.closed = False

    def show(self, k: int, n: int, estimate: Estimate, scan: Scan, slam: Slam) -> None:
        """Show the state of `slam` after scan number `k` of `n`, counted from 1."""
        if self.closed:
            return
        self._poses.append(estimate.pose)
        self._lost.append(estimate.lost > ALARM_LEVEL)
        now = self._clock()
        if now < self._next_frame and k < n:
            return
        if self._quit():
            return self.close()
        if self._background is None or now >= self._next_map or k == n:
            self._draw_map(slam)
            self._next_map = _again(now, self._clock(), MIN_MAP_TIME)
        now = self._clock()
        self._draw(k, n, estimate._replace(pose=slam.pose), scan)  # finishing may revise it
        self._next_frame = _again(now, self._clock(), MIN_FRAME_TIME)

    def finish(self, words: str, doors: Sequence[MappedDoor]) -> None:
        """Show what was found in the line below, and the doors with their numbers on the map, until
        the window is closed or a key is pressed, for `MAX_HOLD` at most."""
        if self.closed or self._background is None:
            return
        self._draw_found(words, doors)
        until = self._clock() + MAX_HOLD
        while self._clock() < until and not self._quit(keys=True):
            self._wait(MIN_WAIT)
        self.close()

    def close(self) -> None:
        """Close the window."""
        import pygame

        self.closed = True
        pygame.display.quit()

    def _quit(self, keys: bool = False) -> bool:
        """Whether the user closed the window, or pressed a key where that counts as well."""
        import pygame

        events = pygame.event.get()
        self._screen = pygame.display.get_surface() or self._screen
        kinds = (pygame.QUIT, pygame.KEYDOWN) if keys else (pygame.QUIT,)
        return any(event.type in kinds for event in events)

    # -- the map and the path so far -------------------------------------------------------------

    def _draw_map(self, slam: Slam) -> None:
        import pygame

        self._poses = [Pose2(*row) for row in believed(slam, np.array(self._poses)).tolist()]
        grid = slam.map()
        size = self._screen.get_width(), self._screen.get_height() - STATUS_HEIGHT
        self._view = _fitting(grid, np.array(self._poses), size)
        self._background = pygame.Surface(size)
        self._background.fill(PALETTE[-3:])
        _blit_grid(self._background, coarser(grid, 1 / self._view.scale), self._view)
        self._draw_path(self._background, 0)
        self._drawn = len(self._poses)

    def _draw_path(self, surface: pygame.Surface, first: int) -> None:
        """Draw the path from a pose on; where the robot was lost, in another colour."""
        import pygame

        points = self._view.points(np.array(self._poses[first:])[:, :2]).tolist()
        if len(points) > 1:
            pygame.draw.lines(surface, colours.VERMILION, False, points, 2)
        for begin, end in stretches(np.array(self._lost[first:])):
            if end - begin > 1:
                pygame.draw.lines(surface, LOST, False, points[begin:end], LOST_PATH_WIDTH)

    # -- a picture -------------------------------------------------------------------------------

    def _draw(self, k: int, n: int, estimate: Estimate, scan: Scan) -> None:
        import pygame

        assert self._background is not None
        self._screen.blit(self._background, (0, 0))
        self._draw_path(self._screen, max(self._drawn - 1, 0))
        pose = estimate.pose
        for point in self._view.points(transform_points(pose, scan.points)).tolist():
            pygame.draw.circle(self._screen, colours.GREEN, point, 2)
        centre = self._view.at(pose.x, pose.y)
        radius = max(ROBOT_RADIUS * self._view.scale, MIN_ROBOT_PIXELS)
        colour = LOST if estimate.lost > ALARM_LEVEL else colours.VERMILION
        pygame.draw.circle(self._screen, colour, centre, radius)
        ahead = pose @ Pose2(radius / self._view.scale, 0.0, 0.0)
        pygame.draw.line(self._screen, colours.PAPER, centre, self._view.at(ahead.x, ahead.y), 2)
        around = self._view.points(outline(estimate.covariance) + pose[:2])
        pygame.draw.polygon(self._screen, colours.BLUE, around.tolist(), 2)
        gone = self._clock() - self._began
        left = f"{_span(gone * (n - k) / k)} left" if k < n else "writing the files"
        end = self._draw_strip(f"scan {k} of {n}   {_span(gone)} elapsed, {left}", LEGEND)
        self._write_lost(estimate.lost, end, self._screen.get_height() - STATUS_HEIGHT // 2)
        pygame.display.flip()

    def _draw_found(self, words: str, doors: Sequence[MappedDoor]) -> None:
        import pygame

        assert self._background is not None
        self._screen.blit(self._background, (0, 0))
        for number, door in enumerate(doors, 1):
            ends = self._view.points(door.ends).tolist()
            pygame.draw.line(self._screen, colours.BLUE, ends[0], ends[1], DOOR_WIDTH)
            x, y = ends[1]
            captions.text(self._screen, str(number), round(x) + DOOR_WIDTH, round(y), colours.BLUE)
        self._draw_strip(words, (("any key closes", colours.FAINT),))
        pygame.display.flip()

    def _draw_strip(self, words: str, legend: Sequence[tuple[str, colours.Colour]]) -> int:
        """Draw the line below; returns where its words end."""
        width, height = self._screen.get_size()
        self._screen.fill(colours.PAPER, (0, height - STATUS_HEIGHT, width, STATUS_HEIGHT))
        middle, right = height - STATUS_HEIGHT // 2, width - captions.TEXT_MARGIN
        end = captions.text(self._screen, words, captions.TEXT_MARGIN, middle)
        for word, colour in legend:
            right -= captions.width_of(word) + captions.TEXT_MARGIN
            captions.text(self._screen, word, right, middle, colour)
        return end

    def _write_lost(self, probability: float, x: int, middle: int) -> None:
        """Write how probably the robot is lost; nothing from a SLAM that does not judge it."""
        if probability > 0.0:
            colour = LOST if probability > ALARM_LEVEL else colours.FAINT
            captions.text(self._screen, f"   lost: {probability:.2f}", x, middle, colour)


LEGEND = (
    ("95 % ellipse", colours.BLUE),
    ("echoes", colours.GREEN),
    ("robot, path", colours.VERMILION),
)


def _again(begun: float, ended: float, least: float) -> float:
    """The next time for work that was begun and ended at these times."""
    return ended + max(least, (ended - begun) / MAX_TIME_SHARE)


def _fitting(grid: OccupancyGrid, poses: Array, size: tuple[int, int]) -> Projection:
    """The view with all observed cells and poses in its middle."""
    box = MapPanel("", grid, poses).box
    room = MARGIN_SHARE * max(box.width, box.height) / 2
    box = Box(box.left - room, box.right + room, box.bottom - room, box.top + room)
    box = box.shaped(size[1] / size[0])
    return Projection(box.left, box.top, size[0] / box.width)


def _blit_grid(surface: pygame.Surface, grid: OccupancyGrid, view: Projection) -> None:
    """Draw the visible part of a map."""
    import pygame

    width, height = surface.get_size()
    low = np.array([[view.left, view.top - height / view.scale]])
    high = np.array([[view.left + width / view.scale, view.top]])
    (first,), (last,) = grid.spec.cells(low), grid.spec.cells(high) + 1
    row0, col0 = np.maximum(first, 0)
    row1, col1 = np.minimum(last, grid.spec.shape)
    if row1 <= row0 or col1 <= col0:
        return
    part = OccupancyGrid(
        grid.spec._replace(row0=grid.spec.row0 + int(row0), col0=grid.spec.col0 + int(col0),
                           rows=int(row1 - row0), cols=int(col1 - col0)),
        grid.occupied[row0:row1, col0:col1], grid.observed[row0:row1, col0:col1],
    )  # fmt: skip
    shade = np.ascontiguousarray(few_shades(part)[::-1])
    image = pygame.image.frombuffer(shade.tobytes(), shade.shape[::-1], "P")
    image.set_palette(np.reshape(PALETTE, (-1, 3)).tolist())
    left, right, bottom, top = part.spec.extent
    (x0, y0), (x1, y1) = view.at(left, top), view.at(right, bottom)
    shown = pygame.transform.scale(image, (round(x1 - x0), round(y1 - y0)))
    surface.blit(shown, (round(x0), round(y0)))


def _span(seconds: float) -> str:
    """A time as h:mm:ss or m:ss."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
