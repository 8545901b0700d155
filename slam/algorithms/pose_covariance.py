"""Covariance of a matched pose: from the match, and from the map that it is matched with."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.maps.tiles import SHIFT, Tiles
from slam.matrices import product, solved, transformed
from slam.motion.gaussian import Prediction, odometry_covariance
from slam.search.laplace import positive

LAST_KEYFRAMES = 8.0  # over which the error that a tile inherits from its keyframes is averaged;
# chosen, with the sharpness of `Endpoint` and of registration, such that errors in the built-in
# worlds are as large as claimed


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
        (n, 2), m, in the robot's frame, lie in; the first keyframe's is taken as it is."""
        tiles = self.tiles
        _settle(*pose, points, tiles.index, tiles.origin, tiles.resolution, self._drawn.values,
                covariance)  # fmt: skip

    def matched(
        self,
        before: Array,
        prediction: Prediction,
        pose: Pose2,
        points: Array,
        information: Array,
    ) -> Array:
        """(3, 3) covariance of a pose matched in the current map.

        before       (3, 3) covariance where the prediction begins
        points       (n, 2) echoes of the scan, m, in the robot's frame
        information  (3, 3) of the match
        """
        tiles = self.tiles
        return _matched(*pose, points, tiles.index, tiles.origin, tiles.resolution,
                        self._drawn.values, before, prediction.step, prediction.gaussian,
                        information)  # fmt: skip

    def covariance(self, pose: Pose2, points: Array) -> Array:
        """(3, 3) covariance of the map's error for a match at `pose` with scan `points` (n, 2), m,
        in the robot's frame: the mean over the points' tiles; zero without points."""
        tiles = self.tiles
        return _inherited(*pose, points, tiles.index, tiles.origin, tiles.resolution,
                          self._drawn.values)  # fmt: skip


@kernel
def _seen(robot_x, robot_y, theta, points, index, origin, resolution):
    """(n,) the slots of the tiles that points, given in the robot's frame, lie in, each once, and
    the number of points in each."""
    c, s, scale = np.cos(theta), np.sin(theta), 1.0 / resolution
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    slots, counts = np.zeros(len(points) + 1, np.int64), np.zeros(len(points) + 1)
    n = here = 0
    for k in range(len(points)):
        x = (robot_x + c * points[k, 0] - s * points[k, 1] - origin[0]) * scale
        y = (robot_y + s * points[k, 0] + c * points[k, 1] - origin[1]) * scale
        if not (0.0 <= x < cols and 0.0 <= y < rows):
            continue
        slot = index[int(y) >> SHIFT, int(x) >> SHIFT]
        if slot == 0:
            continue
        if slots[here] != slot:  # neighbouring points mostly lie in the same tile
            here = 0
            while here < n and slots[here] != slot:
                here += 1
            slots[here], n = slot, max(n, here + 1)
        counts[here] += 1.0
    return slots[:n], counts[:n]


@kernel
def _inherited(x, y, theta, points, index, origin, resolution, drawn):
    """(3, 3) mean over the points of their tiles' covariances, at (x, y)."""
    slots, counts = _seen(x, y, theta, points, index, origin, resolution)
    total, result = 0.0, np.zeros((3, 3))
    for k in range(len(slots)):
        tile = drawn[slots[k]]
        if tile[2] > 0:
            _add_turned(tile[3:], x - tile[0], y - tile[1], counts[k], result)
            total += counts[k]
    return result / max(total, 1.0)


@kernel
def _matched(
    x, y, theta, points, index, origin, resolution, drawn, before, step, gaussian, information
):
    """See `MapUncertainty.matched`."""
    ground = _inherited(x, y, theta, points, index, origin, resolution, drawn)
    return fused(_moved(before, step, gaussian), ground, information)


@kernel
def _settle(x, y, theta, points, index, origin, resolution, drawn, covariance):
    """Take a keyframe at (x, y) into the mean of the tiles that it saw, which move to (x, y)."""
    for slot in _seen(x, y, theta, points, index, origin, resolution)[0]:
        tile = drawn[slot]
        n = min(tile[2], LAST_KEYFRAMES) + 1.0
        mean = np.zeros((3, 3))
        _add_turned(tile[3:], x - tile[0], y - tile[1], 1.0, mean)
        for i in range(3):
            for j in range(3):
                tile[3 + 3 * i + j] = mean[i, j] + (covariance[i, j] - mean[i, j]) / n
        tile[0], tile[1], tile[2] = x, y, n


@kernel
def _add_turned(stored, x, y, weight, total):
    """Add `weight` times the covariance that a tile stores (9,), at (x, y) from there, to `total`
    (3, 3): J C J' with the `lever_jacobian` J."""
    levers = -y, x, 0.0
    for i in range(3):
        a = stored[3 * i] + levers[i] * stored[6]
        b = stored[3 * i + 1] + levers[i] * stored[7]
        c = stored[3 * i + 2] + levers[i] * stored[8]
        total[i, 0] += weight * (a - y * c)
        total[i, 1] += weight * (b + x * c)
        total[i, 2] += weight * c


def carried(covariance: Array, prediction: Prediction) -> Array:
    """(3, 3) covariance of a predicted pose, by that where the prediction begins."""
    return _moved(covariance, prediction.step, prediction.gaussian)


@kernel
def _moved(covariance, step, gaussian):
    """See `carried`: the rest is `Prediction.step` and `Prediction.gaussian`."""
    result = odometry_covariance(*gaussian)
    _add_turned(covariance.ravel(), step[0], step[1], 1.0, result)
    return result


def of_motion(prediction: Prediction, information: Array, theta: float) -> Array:
    """(3, 3) covariance of a motion by the odometry and a match with `information`, seen from the
    heading `theta` at its begin."""
    return _of_motion(prediction.gaussian, information, theta)


@kernel
def _of_motion(gaussian, information, theta):
    within = fused(odometry_covariance(*gaussian), np.zeros((3, 3)), information)
    c, s = np.cos(theta), np.sin(theta)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return transformed(axes, within)


@kernel
def fused(predicted, ground, information):
    """The covariance after a match with `information` about the pose within the map.

    The error of the map (`ground`) is common to prediction and match: it is subtracted, the rest is
    fused with the information, and it is added again.
    """
    within = predicted - ground
    if not positive(within):
        values, axes = np.linalg.eigh(within)
        within = (axes * np.maximum(values, 0.0)) @ axes.T
    sure = solved(np.eye(3) + product(within, information), within)
    return ground + 0.5 * (sure + sure.T)
