"""Lens: how close one looks, and at what; it fits panels into a window."""

from __future__ import annotations

from typing import NamedTuple

from dynslam_env.drawing.captions import TITLE_HEIGHT
from dynslam_env.drawing.view import MIN_PANEL_SIDE, View, fitting_scale
from slam.geometry import Array

STEP = 1.25  # of one key press
CLOSEST = 30.0  # times the scale at which the whole world is seen


class Lens(NamedTuple):
    """What is looked at.

    zoom    1: the whole world just fits
    follow  the robot stays in the middle
    centre  m, what is in the middle if not the robot; None: the middle of the world
    """

    zoom: float = 1.0
    follow: bool = False
    centre: tuple[float, float] | None = None

    def closer(self) -> Lens:
        """One step; from the whole world, towards the robot."""
        whole = self.zoom == 1.0 and self.centre is None
        return Lens(min(self.zoom * STEP, CLOSEST), self.follow or whole, self.centre)

    def farther(self) -> Lens:
        """One step, back to the whole world at last."""
        zoom = self.zoom / STEP
        return Lens() if zoom < (1.0 + STEP) / 2 else self._replace(zoom=zoom)

    def toggled(self, robot: tuple[float, float]) -> Lens:
        """Follow the robot, or stay where it is now."""
        if self.follow:
            return Lens(self.zoom, False, robot if self.zoom > 1.0 else None)
        return Lens(self.zoom, True)

    def view(self, walls: Array, room: tuple[int, int], panels: int) -> View:
        """The view for so many panels in a window with `room` pixels for them."""
        beside, below = _panel(room, panels, 1), _panel(room, 1, panels)
        stacked = fitting_scale(walls, below) > fitting_scale(walls, beside)
        size = below if stacked else beside
        return View(
            pixels_per_metre=self.zoom * fitting_scale(walls, size),
            centre=self.centre,
            follow=self.follow,
            size=size,
            stacked=stacked,
        )


def _panel(room: tuple[int, int], across: int, down: int) -> tuple[int, int]:
    width, height = room[0] // across, room[1] // down - TITLE_HEIGHT
    return max(width // 2 * 2, MIN_PANEL_SIDE), max(height // 2 * 2, MIN_PANEL_SIDE)
