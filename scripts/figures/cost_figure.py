"""Time per scan over the distance travelled: does a SLAM slow down as its map grows?"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from scipy.ndimage import median_filter, percentile_filter

from slam.geometry import Array

from .style import blank_figure

WINDOW_SCANS = 51  # of the running median and percentile


def cost_figure(poses: Array, spent: Array, title: str = "") -> Figure:
    """The time of each update as a dot, their running median and 95th percentile as lines.

    poses  (n, 3) of the robot
    spent  (n,) time of each scan, s
    """
    distance = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])
    ms = np.maximum(1e3 * spent, 1e-3)
    figure = blank_figure(7.0, 3.6)
    axes = figure.add_subplot()
    axes.plot(distance, ms, ".", color="0.75", markersize=2, label="each scan", rasterized=True)
    axes.plot(distance, percentile_filter(ms, 95, WINDOW_SCANS, mode="nearest"), color="tab:orange",
              linewidth=1.0, label=f"95th percentile of {WINDOW_SCANS}")  # fmt: skip
    axes.plot(distance, median_filter(ms, WINDOW_SCANS, mode="nearest"), color="tab:blue",
              linewidth=1.4, label=f"median of {WINDOW_SCANS}")  # fmt: skip
    axes.set_yscale("log")
    axes.set_xlabel("distance, m")
    axes.set_ylabel("ms per scan")
    axes.set_title(title)
    axes.legend(loc="upper left", frameon=False, fontsize="small", ncols=3)
    axes.grid(alpha=0.3, which="both", linewidth=0.4)
    return figure
