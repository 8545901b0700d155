"""What a scan cost against the way that the robot had come: does a SLAM slow down?"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from scipy.ndimage import median_filter, percentile_filter

from slam.geometry import Array

from .style import blank_figure

WINDOW = 51  # scans that a running figure is of


def cost_figure(poses: Array, spent: Array, title: str = "") -> Figure:
    """The time of each update as a dot, their running median and 95th percentile as lines.

    poses  (n, 3) of the robot
    spent  (n,) s
    """
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])
    ms = np.maximum(1e3 * spent, 1e-3)
    figure = blank_figure(7.0, 3.6)
    axes = figure.add_subplot()
    axes.plot(way, ms, ".", color="0.75", markersize=2, label="each scan", rasterized=True)
    axes.plot(way, percentile_filter(ms, 95, WINDOW, mode="nearest"), color="tab:orange",
              linewidth=1.0, label=f"95th percentile of {WINDOW}")  # fmt: skip
    axes.plot(way, median_filter(ms, WINDOW, mode="nearest"), color="tab:blue", linewidth=1.4,
              label=f"median of {WINDOW}")  # fmt: skip
    axes.set_yscale("log")
    axes.set_xlabel("way, m")
    axes.set_ylabel("ms a scan")
    axes.set_title(title)
    axes.legend(loc="upper left", frameon=False, fontsize="small", ncols=3)
    axes.grid(alpha=0.3, which="both", linewidth=0.4)
    return figure
