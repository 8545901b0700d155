"""Patroller: one robot's SLAM and dynamic map, and what a step was worth to them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dynslam_env.patrol.memory import DynamicMap
from dynslam_env.patrol.observation import observe
from dynslam_env.patrol.rewards import RewardTerms, pose_bits
from slam.geometry import Pose2
from slam.interface import Estimate
from slam.scan import Scan


class Patroller:
    """What a patrol amounts to, of one episode. It is never shown the truth.

    memory    the dynamic map
    estimate  of the SLAM, after the last scan
    """

    def __init__(self, first: Estimate, scan: Scan):
        """The SLAM made `first` of the first `scan`."""
        self.memory = DynamicMap()
        self.memory.look(scan, first.pose)
        self.estimate = first
        self._sure = pose_bits(first.covariance)
        self._time = self._looked = scan.time
        self._velocity = np.zeros(2)
        self._information, self._distance, self._touched, self._moments = 0.0, 0.0, 0, 0

    def move(self, displacement: Pose2, collided: bool) -> None:
        """A control step went by."""
        self._distance += math.hypot(displacement.x, displacement.y)
        self._touched += collided
        self._moments += 1

    def look(self, estimate: Estimate, scan: Scan) -> None:
        """The SLAM made `estimate` of a scan."""
        self._information += self.memory.look(scan, estimate.pose)
        moved = self.estimate.pose.between(estimate.pose)
        self._velocity = np.array([moved.x, moved.theta]) / (scan.time - self._looked)
        self.estimate, self._looked = estimate, scan.time

    def gains(self, time: float) -> RewardTerms:
        """What there was to be gained since this was last asked; it is `time` s now."""
        freshness = self.memory.freshness(time) * (time - self._time)
        self._time = time
        before, self._sure = self._sure, pose_bits(self.estimate.covariance)
        collision = self._touched / max(self._moments, 1)
        gains = RewardTerms(
            self._information, freshness, before - self._sure, self._distance, collision
        )
        self._information, self._distance, self._touched, self._moments = 0.0, 0.0, 0, 0
        return gains

    def observation(self, scan: Scan, limits: tuple[float, float]) -> dict[str, Any]:
        """What the agent is shown; see `DoorPatrolEnv`."""
        pose, covariance = self.estimate.pose, self.estimate.covariance
        return observe(self.memory, pose, covariance, scan, self._velocity, limits)
