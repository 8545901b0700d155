"""View: the part of the world that a panel of the picture shows, and its size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slam.errors import InputError
from slam.geometry import Array
from slam.validation import finite, number, whole_number

DEFAULT_SCALE = 60.0  # pixels per metre, unless the world is too large for it
SCALE_LIMITS = (0.1, 2000.0)  # pixels per metre
MAX_PANEL = (1100, 700)  # pixels, of a panel of automatic size
MIN_PANEL = (460, 160)  # pixels, of a panel of automatic size: its texts fit
MIN_PANEL_SIDE = 32  # pixels, if the size is given
BORDER = 0.35  # m, shown around the world
STACKED_ASPECT_RATIO = 1.6  # of a panel; a wider one has the map below, not beside it


class Projection(NamedTuple):
    """World to pixels: x to the right, y up.

    left, top  corner of the picture, m
    scale      pixels per metre
    """

    left: float
    top: float
    scale: float

    def points(self, xy: Array) -> Array:
        """(n, 2) pixel coordinates, right and down, of points (n, 2), m."""
        return (np.asarray(xy) - (self.left, self.top)) * (self.scale, -self.scale)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Pixel coordinates of a point, m."""
        return (x - self.left) * self.scale, (self.top - y) * self.scale


@dataclass(frozen=True)
class View:
    """The part of the world shown by both panels, truth and map, and its scale.

    pixels_per_metre  0.1 to 2000; None: 60, or less if the world is too large for it
    centre            (x, y) m, at the middle of a panel; None: the middle of the world
    follow            keep the robot at the middle instead
    size              (width, height) pixels of a panel, rounded up to even numbers; None: the size
                      of the whole world, at most 1100 x 700
    stacked           True: the map below the truth; False: beside it; None: below for wide panels
    """

    pixels_per_metre: float | None = None
    centre: tuple[float, float] | None = None
    follow: bool = False
    size: tuple[int, int] | None = None
    stacked: bool | None = None

    def __post_init__(self) -> None:
        if self.pixels_per_metre is not None:
            number("View.pixels_per_metre", self.pixels_per_metre, *SCALE_LIMITS)
        if self.centre is not None:
            _pair("View.centre", self.centre)
            finite("View.centre", self.centre)
        if self.centre is not None and self.follow:
            raise InputError("View takes a centre or follow=True, got both")
        if self.size is not None:
            _pair("View.size", self.size)
            for side in self.size:
                whole_number("View.size", side, MIN_PANEL_SIDE)

    def panel(self, walls: Array) -> tuple[int, int]:
        """Even width and height, pixels, of a panel for a world of `walls` (w, 4), m."""
        if self.size is not None:
            return _even(self.size[0]), _even(self.size[1])
        low, high = extent(walls)
        needed = (high - low) * self._scale(walls, MAX_PANEL)
        width, height = np.clip(np.ceil(needed), MIN_PANEL, MAX_PANEL).astype(int).tolist()
        return _even(width), _even(height)

    def projection(
        self, walls: Array, robot: tuple[float, float], panel: tuple[int, int]
    ) -> Projection:
        """The projection to a panel of that size, pixels, with the robot at `robot`, m."""
        scale = self._scale(walls, panel)
        low, high = extent(walls)
        x, y = robot if self.follow else self.centre or (low + high) / 2
        return Projection(x - panel[0] / 2 / scale, y + panel[1] / 2 / scale, scale)

    def below(self, panel: tuple[int, int]) -> bool:
        """Whether the map is below the truth."""
        return panel[0] > STACKED_ASPECT_RATIO * panel[1] if self.stacked is None else self.stacked

    def _scale(self, walls: Array, room: tuple[int, int]) -> float:
        if self.pixels_per_metre is not None:
            return self.pixels_per_metre
        fitting = fitting_scale(walls, room)
        return fitting if self.size else min(DEFAULT_SCALE, fitting)


def fitting_scale(walls: Array, room: tuple[int, int]) -> float:
    """Largest scale, pixels per metre, at which a world of `walls` (w, 4), m, fits into `room`."""
    low, high = extent(walls)
    return float((np.array(room) / (high - low)).min())


def extent(walls: Array) -> tuple[Array, Array]:
    """(2,) lower left and upper right of the walls, or of the origin, with a border, m."""
    ends = walls.reshape(-1, 2) if len(walls) else np.zeros((1, 2))
    return ends.min(axis=0) - BORDER, ends.max(axis=0) + BORDER


def _pair(name: str, value: object) -> None:
    if not isinstance(value, tuple) or len(value) != 2:
        raise InputError(f"{name} must be a tuple of two numbers, got {value!r}")


def _even(pixels: int) -> int:
    return pixels + pixels % 2
