"""A matched keyframe, as the parts of the recovery see it."""

from __future__ import annotations

import math
from typing import NamedTuple

from slam.geometry import Pose2, near
from slam.interface import Estimate
from slam.motion.gaussian import Prediction
from slam.recovery.agreement import Agreement
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

CONTINUOUS = 0.35, math.radians(50.0)  # m, rad, between scans that see much the same
GAP = 1.5  # m between keyframes: the scans were interrupted


class Match(NamedTuple):
    """A keyframe and its match.

    endpoint    reading of the map that it was matched with
    last        pose of the keyframe before
    prediction  of the pose, by the odometry from there
    estimate    of the pose, by the match
    expected    if the odometry jumped before the scan, the motion without that; otherwise None
    """

    endpoint: Endpoint
    scan: Scan
    last: Pose2
    prediction: Prediction
    estimate: Estimate
    expected: Pose2 | None = None

    @property
    def continuous(self) -> bool:
        """Whether by the odometry it was taken so near to the last one that it sees the same; or by
        the match, where the odometry jumped."""
        pose = self.prediction.pose if self.expected is None else self.estimate.pose
        return near(self.last, pose, *CONTINUOUS)

    @property
    def after_gap(self) -> bool:
        """Whether by the odometry it was taken so far from the last one that scans are missing."""
        return math.dist(self.last[:2], self.prediction.pose[:2]) > GAP

    def agreement(self, pose: Pose2) -> Agreement:
        """The agreement of the map with what the scan saw, at a pose."""
        return Agreement(*self.endpoint.shares(self.scan.pieces, pose))
