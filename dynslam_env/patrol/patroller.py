"""Patroller: the state of one patrol, and the reward terms of its steps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dynslam_env.patrol.memory import DynamicMap
from dynslam_env.patrol.observation import observe
from dynslam_env.patrol.rewards import RewardTerms, pose_bits
from slam.geometry import Pose2
from slam.interface import LOST_DISTANCE, LOST_TURN, Estimate
from slam.scan import Scan

MAX_ERROR = LOST_DISTANCE, 2.0 * LOST_TURN  # m, rad: more is no error of the odometry between two
# matches; the SLAM has moved the pose to another place, or scans are missing


class Patroller:
    """The dynamic map and the last estimate of one episode; it is never given the truth.

    memory    the dynamic map
    estimate  of the SLAM, after the last scan
    time      s, of the last call of `gains`
    """

    def __init__(self, first: Estimate, scan: Scan, memory: DynamicMap | None = None):
        """`first` is the SLAM's estimate after the first `scan`; `memory` is empty."""
        self.memory = DynamicMap() if memory is None else memory
        self.memory.look(scan, first.pose)
        self.estimate = first
        self._pose_bits = pose_bits(first.covariance)
        self.time = self._looked = scan.time
        self._velocity, self._moved = np.zeros(2), Pose2()
        self._skipped: list[tuple[Scan, Pose2]] = []  # since the last match, and the odometry to it
        self._information, self._distance, self._contacts, self._control_steps = 0.0, 0.0, 0, 0

    def move(self, displacement: Pose2, collided: bool) -> None:
        """Add a control step."""
        self._moved = self._moved @ displacement
        self._distance += math.hypot(displacement.x, displacement.y)
        self._contacts += collided
        self._control_steps += 1

    def skip(self, scan: Scan) -> None:
        """Keep a scan that the SLAM does not take: `look` adds it to the dynamic map once the next
        pose is known."""
        self._skipped.append((scan, self._moved))

    def look(self, estimate: Estimate, scan: Scan) -> None:
        """Add a scan and the SLAM's estimate of it."""
        moved = self.estimate.pose.between(estimate.pose)
        self._look_at_skipped(self._moved.between(moved), scan.time)
        self._information += self.memory.look(scan, estimate.pose)
        self._velocity = np.array([moved.x, moved.theta]) / (scan.time - self._looked)
        self.estimate, self._looked, self._moved = estimate, scan.time, Pose2()

    def _look_at_skipped(self, error: Pose2, time: float) -> None:
        """Add the skipped scans to the map. Their poses follow the odometry, whose `error` until
        `time`, s, is spread over the time since the last match. They are left out if it is large.
        """
        far, turned = MAX_ERROR
        if math.hypot(error.x, error.y) < far and abs(error.theta) < turned:
            for scan, moved in self._skipped:
                share = (scan.time - self._looked) / (time - self._looked)
                grown = Pose2(*(share * part for part in error))
                self._information += self.memory.look(scan, self.estimate.pose @ moved @ grown)
        self._skipped.clear()

    def gains(self, time: float) -> RewardTerms:
        """The reward terms since the last call; `time` is now, s."""
        freshness = self.memory.freshness(time) * (time - self.time)
        self.time = time
        before, self._pose_bits = self._pose_bits, pose_bits(self.estimate.covariance)
        collision = self._contacts / max(self._control_steps, 1)
        gains = RewardTerms(
            self._information, freshness, before - self._pose_bits, self._distance, collision
        )
        self._information, self._distance, self._contacts, self._control_steps = 0.0, 0.0, 0, 0
        return gains

    def observation(self, scan: Scan, limits: tuple[float, float]) -> dict[str, Any]:
        """The agent's observation; see `DoorPatrolEnv`."""
        pose, covariance = self.estimate.pose, self.estimate.covariance
        return observe(self.memory, pose, covariance, scan, self._velocity, limits)
