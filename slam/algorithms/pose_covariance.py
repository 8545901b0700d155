"""Covariance of a matched pose: from the match, and from the map that it is matched with."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2, lever_jacobian
from slam.kernel import kernel
from slam.maps.tiles import SHIFT, Tiles

SHARPNESS = 30.0  # by how much the information of a keyframe's match exceeds the curvature of its
# likelihood, which is as wide as cells need it; chosen, with LAST_KEYFRAMES, such that errors in
# the built-in worlds are as large as claimed
LAST_KEYFRAMES = 8.0  # over which the error that a tile inherits from its keyframes is averaged


class MapUncertainty:
    """The pose covariance of the map, tile by tile.

    Cells keep the pose error of the keyframes that integrated them. Each tile stores a pose, and
    the running mean, at that pose, of the covariances of the last keyframes with echoes in it; a
    pose matched with the tile inherits this error, transformed rigidly, and adds the error of its
    match. So the covariance grows from keyframe to keyframe where all is new, and shrinks among
    tiles of earlier keyframes. Several maps may share tiles: what a tile stores is copied with it.
    """

    def __init__(self, tiles: Tiles):
        self.tiles = tiles
        self._drawn = tiles.layer(np.float64, 0.0, (12,))  # x, y, number averaged, covariance

    def settle(self, pose: Pose2, covariance: Array, points: Array) -> None:
        """Average the keyframe's covariance into the current map's tiles that its echoes `points`
        (n, 2), m, in the robot's frame, lie in; new tiles get it as it is."""
        tiles, drawn = self.tiles, self._drawn.values
        seen = _echoes(*pose, points, tiles.index, tiles.origin, tiles.resolution, len(drawn))
        _average(drawn, seen, pose.x, pose.y, covariance)
        slots = tiles.current.slots
        new = slots[drawn[slots, 2] == 0]
        drawn[new] = np.array([pose.x, pose.y, 1.0, *covariance.flat])

    def matched(self, predicted: Array, pose: Pose2, points: Array, information: Array) -> Array:
        """(3, 3) covariance of a pose matched in the current map.

        predicted    (3, 3) its covariance before the match
        points       (n, 2) echoes of the scan, m, in the robot's frame
        information  (3, 3) negative Hessian of the log-likelihood at `pose`
        """
        return fused(predicted, self.covariance(pose, points), SHARPNESS * information)

    def covariance(self, pose: Pose2, points: Array) -> Array:
        """(3, 3) covariance of the map's error for a match at `pose` with scan `points` (n, 2), m,
        in the robot's frame: the mean over the points' tiles; zero without points."""
        tiles, drawn = self.tiles, self._drawn.values
        seen = _echoes(*pose, points, tiles.index, tiles.origin, tiles.resolution, len(drawn))
        return _inherited(drawn, seen, pose.x, pose.y)


@kernel
def _echoes(robot_x, robot_y, theta, points, index, origin, resolution, slots):
    """(slots,) the number of points, given in the robot's frame, in the tile of each slot."""
    c, s, scale = np.cos(theta), np.sin(theta), 1.0 / resolution
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    seen = np.zeros(slots)
    for k in range(len(points)):
        x = (robot_x + c * points[k, 0] - s * points[k, 1] - origin[0]) * scale
        y = (robot_y + s * points[k, 0] + c * points[k, 1] - origin[1]) * scale
        if 0.0 <= x < cols and 0.0 <= y < rows:
            seen[index[int(y) >> SHIFT, int(x) >> SHIFT]] += 1.0
    return seen


@kernel
def _inherited(drawn, seen, x, y):
    """(3, 3) mean over the echoes of their tiles' covariances, at (x, y)."""
    total, result = 0.0, np.zeros((3, 3))
    for slot in range(1, len(drawn)):
        if seen[slot] and drawn[slot, 2] > 0:
            result += seen[slot] * _at(drawn[slot], x, y)
            total += seen[slot]
    return result / max(total, 1.0)


@kernel
def _average(drawn, seen, x, y, covariance):
    """Take a keyframe at (x, y) into the mean of the tiles that it saw, which move to (x, y)."""
    for slot in range(1, len(drawn)):
        if seen[slot] and drawn[slot, 2] > 0:
            n = min(drawn[slot, 2], LAST_KEYFRAMES) + 1.0
            mean = _at(drawn[slot], x, y)
            drawn[slot, 3:] = (mean + (covariance - mean) / n).reshape(9)
            drawn[slot, 0], drawn[slot, 1], drawn[slot, 2] = x, y, n


@kernel
def _at(tile, x, y):
    """(3, 3) the covariance that a tile stores, at (x, y)."""
    return _turned(tile[3:].copy().reshape(3, 3), x - tile[0], y - tile[1])


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
