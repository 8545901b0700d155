"""The estimated robot and its path in a film; while it is lost, both are in another colour."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2
from slam.metrics.lost import ALARM_LEVEL

from .canvas import MapCanvas
from .lost_course import stretches
from .style import ESTIMATE, LOST

PATH_WIDTH, LOST_PATH_WIDTH = 1.5, 3.0  # pixels


def draw_path(canvas: MapCanvas, poses: Array, lost: Array) -> None:
    """Draw a path (n, 3), and over it the stretches with `lost` (n,) above ALARM_LEVEL."""
    points = np.asarray(poses)[:, :2]
    canvas.path(points, ESTIMATE, PATH_WIDTH)
    for begin, end in stretches(lost > ALARM_LEVEL):
        canvas.path(points[begin:end], LOST, LOST_PATH_WIDTH)
        canvas.dots(points[begin : begin + 1], LOST, LOST_PATH_WIDTH / 2)


def draw_robot(canvas: MapCanvas, pose: Pose2, lost: float) -> None:
    """Draw the robot; while it is lost, the probability in a corner of the picture too."""
    canvas.robot(pose, LOST if lost > ALARM_LEVEL else ESTIMATE)
    if lost > ALARM_LEVEL:
        canvas.label(f"LOST {lost:.2f}", LOST)
