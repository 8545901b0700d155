"""The paper's figures 2 and 3: the likelihood of the pose around the true one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D
from scipy import ndimage

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.episode import Episode
from slam.geometry import Array, Pose2, transform_points
from slam.grid import OccupancyGrid
from slam.scan import Scan

from .known_poses import blank, known, mapped, mapping, true_poses
from .style import ESTIMATE, INK, LARGE, MEDIUM, PAPER, SMALL, blank_figure, plain_axes

RANGE, STEP = 0.4, 0.01  # m: extent and resolution of the surface around the true pose
PEAK_RADIUS = 0.1  # m: a local maximum is the largest value within it
MIN_PEAK_HEIGHT = 0.7  # of the range from the lowest to the highest value
FREE_RADIUS, MAX_FREE_H = (
    0.1,
    0.3,
)  # m, h: a cell is surely free if all h within the radius are less
COLOUR_MAP = "viridis"


class LikelihoodSurface(NamedTuple):
    """Likelihood per echo over x and y at the true heading.

    offsets  (n,) m from the true pose, of columns and rows
    values   (n, n) exp(log p(z | s, h) / echoes): the geometric mean over the echoes
    """

    offsets: Array
    values: Array

    @property
    def peaks(self) -> Array:
        """(p, 2) x and y of the local maxima, m from the true pose, the highest first."""
        size = 2 * round(PEAK_RADIUS / STEP) + 1
        local = self.values == ndimage.maximum_filter(self.values, size)
        low, high = float(self.values.min()), float(self.values.max())
        rows, cols = np.nonzero(local & (self.values >= low + MIN_PEAK_HEIGHT * (high - low)))
        order = np.argsort(-self.values[rows, cols], kind="stable")
        return np.column_stack([self.offsets[cols], self.offsets[rows]])[order]


def likelihood_figure(
    static_doors: Episode,
    moving_doors: Episode,
    static: str = "static-ml/beta1",
    dynamic: str = "dynamic-ml/beta1",
) -> Figure:
    """Three surfaces, at the scan that contradicts the static map most.

    The maps hold the scans before it, at their true poses. The episodes are a pair: the
    same drive with static and with moving doors. Variants of maximum likelihood; beta 1 gives the
    likelihood of one echo.
    """
    moment = surprise(moving_doors, static)
    cases = (
        ("Figure 2: static map, static doors", static, static_doors),
        ("Figure 3: static map, moving doors", static, moving_doors),
        ("Ours: dynamic map, moving doors", dynamic, moving_doors),
    )
    surfaces = [_surface_at(variant, episode, moment) for _, variant, episode in cases]
    top = max(float(surface.values.max()) for surface in surfaces)
    figure = blank_figure(10.0, 6.8, arrange=False)  # reliefs cannot be arranged
    figure.subplots_adjust(0.06, 0.12, 0.98, 0.89, wspace=0.25, hspace=0.2)
    for column, ((title, _, _), surface) in enumerate(zip(cases, surfaces, strict=True), start=1):
        relief = figure.add_subplot(2, 3, column, projection="3d")
        assert isinstance(relief, Axes3D)
        _draw_relief(relief, surface, top, title)
        _draw_plan(figure.add_subplot(2, 3, 3 + column), surface)
    time = moving_doors.scans[moment].time
    figure.suptitle(
        f"Likelihood per echo around the true pose, {time:.1f} s into the drive", fontsize=LARGE
    )
    handles, labels = figure.axes[1].get_legend_handles_labels()
    legend = {"facecolor": "#505868", "labelcolor": PAPER, "fontsize": SMALL, "ncol": 3}
    figure.legend(handles, labels, loc="lower center", **legend)
    return figure


def surprise(episode: Episode, variant: str = "static-ml/beta1") -> int:
    """The scan with the most echoes in cells that are surely free in the map before it."""
    slam, poses = blank(variant), true_poses(episode)
    contradicted = {
        number: _contradicted(slam.map_model.cells.grid(), episode.scans[number], poses[number])
        for number in mapping(slam, episode)
    }
    return max(contradicted, key=lambda number: contradicted[number])


def _contradicted(grid: OccupancyGrid, scan: Scan, pose: Pose2) -> int:
    """Echoes in cells that were observed, and with nothing occupied within `FREE_RADIUS`."""
    cells = grid.spec.cells(transform_points(pose, scan.points))
    cells = cells[((cells >= 0) & (cells < grid.spec.shape)).all(axis=1)]
    if not len(cells):
        return 0
    nearby = ndimage.maximum_filter(
        grid.occupied, 2 * round(FREE_RADIUS / grid.spec.resolution) + 1
    )
    rows, cols = cells.T
    return int((grid.observed[rows, cols] & (nearby[rows, cols] < MAX_FREE_H)).sum())


def _surface_at(variant: str, episode: Episode, moment: int) -> LikelihoodSurface:
    slam = mapped(variant, episode, until=moment)
    return surface(slam, episode.scans[moment], Pose2.of(known(episode).poses[moment]))


def surface(slam: MaximumLikelihood, scan: Scan, pose: Pose2) -> LikelihoodSurface:
    """The likelihood of `scan` around `pose`, at its heading."""
    offsets = np.linspace(-RANGE, RANGE, 2 * round(RANGE / STEP) + 1)
    dx, dy = (grid.ravel() for grid in np.meshgrid(offsets, offsets))
    poses = np.column_stack([pose.x + dx, pose.y + dy, np.full(dx.shape, pose.theta)])
    per_echo = slam.sensor_model.log_likelihood(scan, poses) / max(len(scan.points), 1)
    return LikelihoodSurface(offsets, np.exp(per_echo).reshape(len(offsets), len(offsets)))


def _draw_relief(axes: Axes3D, surface: LikelihoodSurface, top: float, title: str) -> None:
    x, y = np.meshgrid(surface.offsets, surface.offsets)
    shape = {"rstride": 2, "cstride": 2, "linewidth": 0.0, "antialiased": False}
    axes.plot_surface(x, y, surface.values, cmap=COLOUR_MAP, vmin=0.0, vmax=top, **shape)
    axes.set(zlim=(0.0, top), xticks=(-0.4, 0, 0.4), yticks=(-0.4, 0, 0.4))
    axes.tick_params(labelsize=SMALL, colors=INK, pad=-1)
    axes.view_init(elev=28, azim=-60)
    axes.set_title(title, fontsize=MEDIUM)


def _draw_plan(axes: Axes, surface: LikelihoodSurface) -> None:
    offsets, peaks = surface.offsets, surface.peaks
    axes.pcolormesh(offsets, offsets, surface.values, cmap=COLOUR_MAP)
    axes.contour(offsets, offsets, surface.values, 8, colors=PAPER, linewidths=0.4, alpha=0.6)
    marks = {"linestyle": "", "markeredgecolor": INK, "clip_on": False, "zorder": 5}
    axes.plot(*peaks[0], "^", color=ESTIMATE, markersize=9, label="maximum", **marks)
    axes.plot(*peaks[1:].T, "o", color=PAPER, markersize=5, label="lower local maximum", **marks)
    true = {"linestyle": "", "markersize": 15, "markeredgewidth": 1.6, "zorder": 6}
    axes.plot(0, 0, "+", color=PAPER, label="true pose", **true)
    axes.set_title(_verdict(peaks), fontsize=MEDIUM)
    axes.set_xlabel("x - true x [m]", fontsize=SMALL)
    axes.set_ylabel("y - true y [m]", fontsize=SMALL)
    axes.set_aspect("equal")
    plain_axes(axes)


def _verdict(peaks: Array) -> str:
    """Distance of the maximum from the true pose, and the number of other peaks, in words."""
    away, others = 100 * float(np.hypot(*peaks[0])), len(peaks) - 1
    at_edge = float(np.abs(peaks[0]).max()) > RANGE - STEP / 2
    rivals = "no other" if not others else f"{others} other{'s' if others > 1 else ''}"
    return f"maximum {'at least ' if at_edge else ''}{away:.0f} cm off, {rivals}"
