"""Painter: draws a scene (the truth) and a belief (a SLAM's map) on two panels.

pygame is imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dynslam_env.drawing import captions, colours
from dynslam_env.drawing.canvas import SUPERSAMPLING, Canvas
from dynslam_env.drawing.captions import TITLE_HEIGHT
from dynslam_env.drawing.free_space import FreeSpace, free_space
from dynslam_env.drawing.scene import Belief, Scene
from dynslam_env.drawing.view import Projection, View
from slam.geometry import Array

if TYPE_CHECKING:
    import pygame

MAP_SUPERSAMPLING = 2  # lower: a map has few lines, and its cells cost time


class Painter:
    """Paints pictures.

    All pictures of one view have the size of the first, even if a later world is larger.

    supersampling  factor of the panel of the truth
    """

    def __init__(self, supersampling: int = SUPERSAMPLING):
        self._supersampling = supersampling
        self._floor: tuple[Array, FreeSpace] | None = None
        self._canvases: tuple[Canvas, Canvas] | None = None
        self._sized: tuple[View, tuple[int, int]] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """A copy gets canvases of its own at its first picture."""
        return self.__dict__ | {"_canvases": None}

    def picture(self, scene: Scene, belief: Belief | None, view: View) -> pygame.Surface:
        """The picture; its sides are even, as video encoders need them."""
        size = self._size(view, scene.walls)
        truth, map_ = self._fresh(size)
        projection = view.projection(scene.walls, (scene.pose.x, scene.pose.y), size)
        panels = [_truth(scene, self._free(scene), projection, truth)]
        if belief is not None:
            panels.append(_belief(scene, belief, projection, map_))
        return _arranged(panels, view.below(size))

    def _fresh(self, size: tuple[int, int]) -> tuple[Canvas, Canvas]:
        """The canvases for the truth and for the map, reused from picture to picture."""
        if self._canvases is None or self._canvases[0].size != size:
            self._canvases = Canvas(size, self._supersampling), Canvas(size, MAP_SUPERSAMPLING)
        return self._canvases

    def _size(self, view: View, walls: Array) -> tuple[int, int]:
        if self._sized is None or self._sized[0] != view:
            self._sized = view, view.panel(walls)
        return self._sized[1]

    def _free(self, scene: Scene) -> FreeSpace:
        if self._floor is None or self._floor[0] is not scene.walls:
            at = scene.pose.x, scene.pose.y
            self._floor = scene.walls, free_space(scene.walls, at)
        return self._floor[1]


def _truth(scene: Scene, free: FreeSpace, projection: Projection, canvas: Canvas) -> pygame.Surface:
    canvas.clear(projection, colours.SOLID)
    canvas.floor(free)
    canvas.fan(scene.taken_from, scene.scan)
    canvas.lines(scene.walls, colours.FACE, 2.4)
    for sweep, leaf in zip(scene.sweeps, scene.leaves, strict=True):
        canvas.sweep(sweep, float(np.hypot(*(leaf[0, 2:] - leaf[0, :2]))))
        canvas.leaf(leaf[:, :2], colours.ORANGE)
    canvas.echoes(scene.taken_from, scene.scan)
    canvas.trail(scene.trail, colours.BLUE)
    for x, y, radius in scene.people.tolist():
        canvas.person(x, y, radius)
    canvas.robot(scene.pose, scene.radius, colours.BLUE)
    panel, strip = _panel(canvas)
    captions.title(strip, scene.title, captions.MAX_SCALE_BAR + 60)
    captions.scale_bar(strip, projection.scale)
    return panel


def _belief(scene: Scene, belief: Belief, projection: Projection, canvas: Canvas) -> pygame.Surface:
    canvas.clear(projection, colours.UNKNOWN)
    canvas.grid(belief.grid)
    canvas.lines(scene.walls, colours.SKY, 1.0)
    canvas.trail(scene.trail, colours.BLUE)
    canvas.trail(belief.trail, colours.VERMILION)
    canvas.robot(belief.pose, scene.radius, colours.VERMILION)
    canvas.robot(scene.pose, scene.radius, colours.BLUE, filled=False)
    panel, strip = _panel(canvas)
    captions.title(strip, belief.title, captions.LEGEND_WIDTH + captions.TEXT_MARGIN)
    captions.legend(strip)
    return panel


def _panel(canvas: Canvas) -> tuple[pygame.Surface, pygame.Surface]:
    """The drawing below an empty strip for its title, and that strip."""
    import pygame

    width, height = canvas.size
    panel = pygame.Surface((width, height + TITLE_HEIGHT))
    panel.blit(canvas.shown(), (0, TITLE_HEIGHT))
    return panel, panel.subsurface((0, 0, width, TITLE_HEIGHT))


def _arranged(panels: list[pygame.Surface], below: bool) -> pygame.Surface:
    """The panels in a column or in a row, with a line between them."""
    import pygame

    width, height = panels[0].get_size()
    across, down = (1, len(panels)) if below else (len(panels), 1)
    picture = pygame.Surface((width * across, height * down))
    for i, panel in enumerate(panels):
        x, y = (0, i * height) if below else (i * width, 0)
        picture.blit(panel, (x, y))
        if i:
            end = (width, y) if below else (x, height)
            pygame.draw.line(picture, colours.FAINT, (x, y), end)
    return picture
