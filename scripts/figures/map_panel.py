"""One map in one axes: the cells, the true walls thin over it, the trajectories."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb

from slam.episode import Truth
from slam.geometry import Array
from slam.grid import OCCUPIED, OccupancyGrid
from slam.metrics.lost import ALARM_LEVEL

from .joining import blocks, coarse, cut, fold_for
from .style import DOORS, ESTIMATE, LARGE, LOST, SMALL, TRUTH, UNKNOWN, WALLS, plain_axes

MARGIN, MARGIN_SHARE = 0.4, 0.01  # m around what is shown, or more: of its longer side
LOST_WIDTH_FACTOR = 3.0  # times the width of the path
LOST_LABEL = f"lost (p > {ALARM_LEVEL:g})"
MIN_OBSERVED = 2.0  # m; rows and columns of cells with less do not widen the picture


class Box(NamedTuple):
    """A rectangle in the world, m."""

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
    """The data of one map in a figure.

    title  a line above
    grid   the map
    poses  (n, 3) estimated trajectory, or None
    truth  or None
    scan   the true doors are shown at this scan, negative from the end
    lost   (n,) bool, at which poses the robot was lost; or None
    """

    title: str
    grid: OccupancyGrid
    poses: Array | None = None
    truth: Truth | None = None
    scan: int = -1
    lost: np.ndarray | None = None

    @property
    def box(self) -> Box:
        """Box with a margin around poses, walls and observed cells, but for stray beams."""
        points = [_observed_corners(self.grid)]
        if self.poses is not None and len(self.poses):
            points.append(self.poses[:, :2])
        if self.truth is not None:
            points.append(self.truth.walls.reshape(-1, 2))
        corners = np.concatenate(points)
        if not len(corners):
            corners = np.zeros((1, 2))
        (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        margin = max(MARGIN, MARGIN_SHARE * max(x1 - x0, y1 - y0))
        return Box(x0 - margin, x1 + margin, y0 - margin, y1 + margin)


def draw_panel(axes: Axes, panel: MapPanel, box: Box | None = None) -> None:
    """Draw `panel` into `axes`, cut to `box` (default: the box of the panel)."""
    box = box or panel.box
    draw_map(axes, panel.grid, box)
    thin = min(1.0, 25.0 / max(box.width, box.height))  # a large building needs thinner lines
    if panel.truth is not None:
        draw_truth(axes, panel.truth, panel.scan)
        axes.plot(*panel.truth.poses[:, :2].T, color=TRUTH, linewidth=2.4, label="true path")
    if panel.poses is not None:
        x, y = panel.poses[:, :2].T
        width = 0.4 + 0.6 * thin
        axes.plot(x, y, color=ESTIMATE, linewidth=width, label="estimated path")
        if panel.lost is not None and panel.lost.any():
            draw_lost_path(axes, panel.poses, panel.lost, LOST_WIDTH_FACTOR * width)
    axes.set_title(panel.title, fontsize=LARGE)


def draw_lost_path(axes: Axes, poses: Array, lost: np.ndarray, width: float) -> None:
    """Draw the poses (n, 3) at which the robot was lost, (n,) bool, as wide lines, points."""
    x, y = np.where(lost[:, None], poses[:, :2], np.nan).T
    dots = {"marker": "o", "markersize": width, "markeredgewidth": 0.0}  # single scans too
    axes.plot(x, y, color=LOST, linewidth=width, label=LOST_LABEL, **dots)


def draw_map(axes: Axes, grid: OccupancyGrid, box: Box) -> None:
    """Draw the cells of `grid` within `box`: occupied dark, free white, unknown grey; axes in m."""
    axes.set_facecolor(UNKNOWN)
    if grid.observed.any():
        spec, occupied = cut(grid.spec, grid.occupied, box)
        _, observed = cut(grid.spec, grid.observed, box)
        image = shades(OccupancyGrid(spec, occupied, observed))
        axes.imshow(image, extent=spec.extent, origin="lower", interpolation="nearest")
    axes.set(xlim=box[:2], ylim=box[2:], aspect="equal")
    axes.set_xlabel("x [m]", fontsize=SMALL, labelpad=1)
    axes.set_ylabel("y [m]", fontsize=SMALL, labelpad=1)
    plain_axes(axes)


def draw_truth(axes: Axes, truth: Truth, scan: int) -> None:
    """Draw the true walls, and the true doors at a scan, as thin lines."""
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
    """(2, 2) corners of the rows and columns with more than MIN_OBSERVED of cells, m; or (0, 2).

    A beam that leaves through a window would otherwise make the building small in the picture.
    """
    ends = []
    for axis in (1, 0):
        seen = grid.observed.sum(axis=axis)
        enough = min(MIN_OBSERVED / grid.spec.resolution, seen.max(initial=0) / 2)
        ends.append(np.flatnonzero(seen > enough)[[0, -1]] if seen.any() else [])
    return grid.spec.centres(np.column_stack(ends)) if len(ends[0]) else np.zeros((0, 2))


def coarser(grid: OccupancyGrid, pixel: float) -> OccupancyGrid:
    """The map in larger cells, by a power of two, at least the size of a pixel, m.

    Each is as occupied as the most occupied observed cell in it, if that is rather occupied: walls
    thinner than a pixel stay dark. Else it has their mean: what is free stays light. The map
    itself if its cells are at least as large as a pixel.
    """
    spec, fold = grid.spec, fold_for(grid.spec.resolution, pixel)
    if fold == 1:
        return grid
    rows, cols = blocks(spec.row0, spec.rows, fold), blocks(spec.col0, spec.cols, fold)
    occupied, count = np.empty((len(rows), len(cols))), np.empty((len(rows), len(cols)))
    for k, (first, last) in enumerate(pairwise([*rows, spec.rows])):  # needs little memory
        seen = grid.observed[first:last]
        part = np.where(seen, grid.occupied[first:last], 0.0)
        highest = np.maximum.reduceat(part.max(axis=0), cols)
        count[k] = np.add.reduceat(seen.sum(axis=0), cols)
        mean = np.add.reduceat(part.sum(axis=0), cols) / np.maximum(count[k], 1)
        occupied[k] = np.where(highest > OCCUPIED, highest, mean)
    return OccupancyGrid(coarse(spec, fold), np.where(count > 0, occupied, 0.5), count > 0)
