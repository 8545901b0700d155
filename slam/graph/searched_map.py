"""The global map as a field in which the robot is searched for."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slam.geometry import Array, Pose2, between, compose
from slam.graph.bulk import NO_CELLS
from slam.graph.local_map import LocalMap
from slam.graph.whole_map import WholeMap
from slam.kernel import kernel
from slam.maps.static import Static
from slam.sensor_models.endpoint import Endpoint

MAX_SHIFT, MAX_TURN = 0.1, math.radians(1.0)  # m, rad, of a local map before the map is redone
MOST_BENT = 0.1  # share of the local maps, at most, that may lie to each other otherwise than drawn
NEIGHBOURS = 12.0  # m, at most, between local maps that a scan shows together


class SearchedMap:
    """The whole map as a likelihood field."""

    def __init__(self) -> None:
        self._whole = WholeMap(Static, MAX_SHIFT, MAX_TURN)
        self._endpoint = Endpoint()

    @property
    def nbytes(self) -> int:
        """Bytes of the tiles."""
        return self._whole.nbytes

    def forget(self, number: int) -> None:
        """See `WholeMap.forget`."""
        self._whole.forget(number)

    def endpoint(self, places: Sequence[LocalMap], poses: Array) -> Endpoint:
        """The field of the local maps `places` at `poses` (n, 3), valid until the next call."""
        known, changed = self._whole.map_model, [NO_CELLS]
        for cells in self._whole.drawing(places, poses):
            if self._whole.map_model is known:  # of one that was built anew all cells are read
                changed.append(cells)
        self._endpoint.refresh(self._whole.map_model, np.concatenate(changed))
        return self._endpoint

    def around(
        self, places: Sequence[LocalMap], poses: Array, pose: Pose2
    ) -> tuple[Endpoint, Pose2]:
        """The field, and `pose` in it. The drawing is kept while local maps have hardly moved
        against their NEIGHBOURS, even if many have moved together; `pose` is moved with the nearest
        one. It is drawn at `poses` if one near to `pose` has moved so, or more than MOST_BENT."""
        drawn = self._whole.poses
        for new in poses[len(drawn) :]:
            drawn = np.vstack([drawn, _moved_with_nearest(drawn, poses, new)])
        bent = _bent(drawn, poses)
        near = np.hypot(*(poses[:, :2] - pose[:2]).T) < NEIGHBOURS
        if bent.sum() > MOST_BENT * len(bent) or (bent & near).any():
            drawn = poses
        endpoint = self.endpoint(places, drawn)
        return endpoint, Pose2.of(_moved_with_nearest(self._whole.poses, poses, np.array(pose)))


def _moved_with_nearest(drawn: Array, poses: Array, pose: Array) -> Array:
    """(3,) a pose moved as the nearest of `poses`, of which the first (n, 3) were `drawn`."""
    if not len(drawn):
        return pose
    apart = np.hypot(*(poses[: len(drawn), :2] - pose[:2]).T)
    nearest = int(apart.argmin())
    return compose(drawn[nearest], between(poses[nearest], pose))


@kernel
def _bent(drawn, poses):
    """(n,) whether each local map has moved against one of its NEIGHBOURS from one array of poses
    (n, 3) to the other, by more than MAX_SHIFT, seen from one of both, or MAX_TURN."""
    bent = np.zeros(len(drawn), np.bool_)
    c, s = np.cos(poses[:, 2] - drawn[:, 2]), np.sin(poses[:, 2] - drawn[:, 2])
    for i in range(len(drawn)):
        for j in range(i):
            x, y = drawn[j, 0] - drawn[i, 0], drawn[j, 1] - drawn[i, 1]
            now_x, now_y = poses[j, 0] - poses[i, 0], poses[j, 1] - poses[i, 1]
            if min(x * x + y * y, now_x * now_x + now_y * now_y) > NEIGHBOURS * NEIGHBOURS:
                continue
            turn = np.arctan2(s[j] * c[i] - c[j] * s[i], c[j] * c[i] + s[j] * s[i])
            for k in (i, j):
                dx, dy = now_x - c[k] * x + s[k] * y, now_y - s[k] * x - c[k] * y
                if dx * dx + dy * dy > MAX_SHIFT * MAX_SHIFT or abs(turn) > MAX_TURN:
                    bent[i] = bent[j] = True
    return bent
