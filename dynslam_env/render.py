"""The picture: the world with robot, doors and beams, and beside it what a SLAM believes.

pygame is imported when something is drawn for the first time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.canvas import BLUE, FACE, FAINT, FINE, ORANGE, PAPER, SKY, SOLID, VERMILION, Canvas
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.scan import Scan

if TYPE_CHECKING:
    import pygame


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
