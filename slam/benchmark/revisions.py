"""Where the map of a run had its earlier scans, each time that they were moved."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2, wrap_angle
from slam.interface import Estimate, Slam, believed
from slam.metrics.within_map import LOST_DISTANCE, LOST_TURN

MOVED = 0.1 * LOST_DISTANCE, 0.1 * LOST_TURN  # m, rad: a smaller move is kept with the next one


class Revisions:
    """Follows a run, and keeps the poses of its scans each time that the SLAM moved an earlier one.

    poses  (k, 3) arrays: of the first k scans, as the k-th made the SLAM move them
    """

    def __init__(self, slam: Slam):
        self._slam = slam
        self._online = np.zeros((0, 3))
        self._new: list[Pose2] = []  # of the scans since the last move
        self.poses: list[Array] = []

    def take(self, estimate: Estimate) -> None:
        """Take in what the SLAM told of the next scan."""
        self._new.append(estimate.pose)
        if not estimate.revised:
            return
        online = self._online = np.concatenate([self._online, np.array(self._new)])
        self._new.clear()
        now, kept = believed(self._slam, online), self.poses[-1] if self.poses else online[:0]
        off = now - np.concatenate([kept, online[len(kept) :]])
        farthest, most_turned = MOVED
        apart, turned = np.hypot(off[:, 0], off[:, 1]), np.abs(wrap_angle(off[:, 2]))
        if apart.max() > farthest or turned.max() > most_turned:
            self.poses.append(now)
