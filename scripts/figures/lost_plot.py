"""How probably the robot was lost, over time: a flat plot below a map."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from slam.geometry import Array
from slam.metrics.lost import ALARM_LEVEL

from .lost_course import LostCourse, stretches
from .style import FAINT, INK, LOST, SMALL, plain_axes

BAND_OPACITY = 0.35
MIN_BAND_WIDTH = 1.0  # points, so that a single scan of a long drive is seen


def draw_lost(axes: Axes, course: LostCourse) -> None:
    """Draw the probability against the time since the first scan; bands where the robot is lost."""
    since_start = course.times - course.times[0]
    axes.broken_barh(
        _bands(since_start, course.lost), (0.0, 1.0), color=LOST, alpha=BAND_OPACITY,
        linewidth=MIN_BAND_WIDTH,
    )  # fmt: skip
    axes.axhline(ALARM_LEVEL, color=FAINT, linewidth=0.6, linestyle="--")
    axes.step(since_start, course.probability, where="post", color=INK, linewidth=0.8)
    axes.set(xlim=(0.0, max(since_start[-1], 1e-3)), ylim=(-0.05, 1.05), yticks=(0.0, 0.5, 1.0))
    axes.set_xlabel("time [s]", fontsize=SMALL, labelpad=1)
    axes.set_ylabel("p(lost)", fontsize=SMALL, labelpad=1)
    plain_axes(axes)


def _bands(times: Array, lost: np.ndarray) -> list[tuple[float, float]]:
    """Begin and length of each time of being lost, s; it ends at the next scan."""
    until = np.append(times[1:], times[-1:])
    return [(times[begin], until[end - 1] - times[begin]) for begin, end in stretches(lost)]
