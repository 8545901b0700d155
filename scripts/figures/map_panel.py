"""One map in one axes: the cells, the true walls thin over it, the trajectories."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb

from slam.episode import Truth
from slam.geometry import Array
from slam.grid import OccupancyGrid

from .style import DOORS, ESTIMATE, LARGE, SMALL, TRUTH, UNKNOWN, WALLS, plain_axes

MARGIN = 0.4  # m around what is shown
STRAY = 2.0  # m observed of a row or column of cells: what has less does not widen the picture


class Box(NamedTuple):
    """A part of the world, m."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def width(self) -> float:
        """Along x, m."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Along y, m."""
        return self.top - self.bottom

    def shaped(self, aspect: float) -> Box:
        """The smallest box around this one with `aspect` = height / width."""
        wider = max(self.height / aspect - self.width, 0.0) / 2
        taller = max(self.width * aspect - self.height, 0.0) / 2
        return Box(self.left - wider, self.right + wider, self.bottom - taller, self.top + taller)


class MapPanel(NamedTuple):
    """What one map is drawn from.

    title  a line above
    grid   the map
    poses  (n, 3) as estimated, or None
    truth  where known
    scan   at which scan the true doors are shown, negative from the end
    """

    title: str
    grid: OccupancyGrid
    poses: Array | None = None
    truth: Truth | None = None
    scan: int = -1

    @property
    def box(self) -> Box:
        """All that was observed (but for stray beams), walked or is true, and a margin."""
        points = [_observed_corners(self.grid)]
        if self.poses is not None and len(self.poses):
            points.append(self.poses[:, :2])
        if self.truth is not None:
            points.append(self.truth.walls.reshape(-1, 2))
        corners = np.concatenate(points)
        if not len(corners):
            corners = np.zeros((1, 2))
        (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return Box(x0 - MARGIN, x1 + MARGIN, y0 - MARGIN, y1 + MARGIN)


def draw_panel(axes: Axes, panel: MapPanel, box: Box | None = None) -> None:
    """Draw `panel` into `axes`, cut to `box` (default: all of it)."""
    box = box or panel.box
    draw_map(axes, panel.grid, box)
    thin = min(1.0, 25.0 / max(box.width, box.height))  # a large building needs thinner lines
    if panel.truth is not None:
        draw_truth(axes, panel.truth, panel.scan)
        axes.plot(*panel.truth.poses[:, :2].T, color=TRUTH, linewidth=2.4, label="true path")
    if panel.poses is not None:
        x, y = panel.poses[:, :2].T
        axes.plot(x, y, color=ESTIMATE, linewidth=0.4 + 0.6 * thin, label="estimated path")
    axes.set_title(panel.title, fontsize=LARGE)


def draw_map(axes: Axes, grid: OccupancyGrid, box: Box) -> None:
    """The cells of `grid` within `box`: occupied dark, free white, unknown grey; axes in m."""
    axes.set_facecolor(UNKNOWN)
    if grid.observed.any():
        axes.imshow(shades(grid), extent=grid.spec.extent, origin="lower", interpolation="auto")
    axes.set(xlim=box[:2], ylim=box[2:], aspect="equal")
    axes.set_xlabel("x [m]", fontsize=SMALL, labelpad=1)
    axes.set_ylabel("y [m]", fontsize=SMALL, labelpad=1)
    plain_axes(axes)


def draw_truth(axes: Axes, truth: Truth, scan: int) -> None:
    """The true walls, and the doors as they stand at a scan, thin."""
    for segments, colour, label in (
        (truth.walls, WALLS, "true walls"),
        (truth.doors[scan], DOORS, "true doors"),
    ):
        lines = list(segments.reshape(-1, 2, 2))
        axes.add_collection(LineCollection(lines, colors=colour, linewidths=0.9, label=label))


def shades(grid: OccupancyGrid) -> np.ndarray:
    """(rows, cols, 3) uint8: h from white (0) to black (1), unobserved cells grey."""
    grey = np.round(255 * (1.0 - np.clip(grid.occupied, 0.0, 1.0))).astype(np.uint8)
    image = np.repeat(grey[:, :, None], 3, axis=2)
    image[~grid.observed] = np.round(255 * np.array(to_rgb(UNKNOWN))).astype(np.uint8)
    return image


def _observed_corners(grid: OccupancyGrid) -> Array:
    """(2, 2) of the box around all rows and columns that hold more than a few beams, m; or (0, 2).

    A beam that leaves through a window would otherwise make a building small.
    """
    ends = []
    for axis in (1, 0):
        seen = grid.observed.sum(axis=axis)
        enough = min(STRAY / grid.spec.resolution, seen.max(initial=0) / 2)
        ends.append(np.flatnonzero(seen > enough)[[0, -1]] if seen.any() else [])
    return grid.spec.centres(np.column_stack(ends)) if len(ends[0]) else np.zeros((0, 2))
