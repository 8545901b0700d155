"""Covariance of a matched pose: from the match, and from the map that it is matched with."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2, lever_jacobian
from slam.kernel import kernel
from slam.maps.tiles import SHIFT, Tiles


class MapUncertainty:
    """The pose covariance of the map, tile by tile.

    Cells keep the pose error of the keyframe that integrated them. Each tile stores the pose and
    the covariance of the first keyframe that saw it; a pose matched with the tile inherits this
    error, transformed rigidly from that keyframe. Valid for the tiles of a single map: it relies on
    slots being assigned in order, without freed or copied ones.
    """

    def __init__(self, tiles: Tiles):
        self.tiles = tiles
        self._drawn = tiles.layer(np.float64, 0.0, (11,))  # x, y, covariance
        self._settled = 1

    def settle(self, pose: Pose2, covariance: Array) -> None:
        """Assign the keyframe's pose and covariance to the new tiles."""
        new = self._drawn.values[self._settled : self.tiles.used]
        new[:, 0], new[:, 1] = pose.x, pose.y
        new[:, 2:] = covariance.reshape(9)
        self._settled = self.tiles.used

    def covariance(self, pose: Pose2, points: Array) -> Array:
        """(3, 3) covariance of the map's error for a match at `pose` with scan `points` (n, 2), m,
        in the robot's frame: the mean over the points' tiles; zero without points."""
        tiles = self.tiles
        return _inherited(*pose, points, tiles.index, tiles.origin, tiles.resolution,
                          self._drawn.values, self._settled)  # fmt: skip


@kernel
def _inherited(robot_x, robot_y, theta, points, index, origin, resolution, drawn, settled):
    c, s, scale = np.cos(theta), np.sin(theta), 1.0 / resolution
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    seen = np.zeros(settled)
    for k in range(len(points)):
        x = (robot_x + c * points[k, 0] - s * points[k, 1] - origin[0]) * scale
        y = (robot_y + s * points[k, 0] + c * points[k, 1] - origin[1]) * scale
        if 0.0 <= x < cols and 0.0 <= y < rows:
            slot = index[int(y) >> SHIFT, int(x) >> SHIFT]
            if 0 < slot < settled:
                seen[slot] += 1.0
    total, result = seen.sum(), np.zeros((3, 3))
    for slot in range(settled):
        if seen[slot]:
            moved = _turned(drawn[slot, 2:].copy().reshape(3, 3), robot_x - drawn[slot, 0],
                            robot_y - drawn[slot, 1])  # fmt: skip
            result += moved * (seen[slot] / total)
    return result


@kernel
def _turned(covariance, x, y):
    """The covariance of a pose rigidly attached at (x, y), world axes, from the given pose."""
    J = lever_jacobian(x, y)
    return J @ covariance @ J.T


@kernel
def moved(covariance, x, y, odometry):
    """The covariance after a displacement (x, y), world, with error covariance `odometry`."""
    return _turned(covariance, x, y) + odometry


@kernel
def fused(predicted, ground, information):
    """The covariance after a match with `information` about the pose within the map.

    The error of the map (`ground`) is common to prediction and match: it is subtracted, the rest is
    fused with the information, and it is added again.
    """
    values, axes = np.linalg.eigh(predicted - ground)
    within = (axes * np.maximum(values, 0.0)) @ axes.T
    sure = np.linalg.solve(np.eye(3) + within @ information, within)
    return ground + 0.5 * (sure + sure.T)
