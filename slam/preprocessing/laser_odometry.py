"""Laser odometry: the odometry from the scans alone, for recordings without one."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Iterator

import numpy as np

from slam.episode import Episode
from slam.geometry import Array, Pose2
from slam.interface import Posterior
from slam.maps.recency import Recency
from slam.motion.gaussian import Prediction
from slam.motion.threshold import KEYFRAMES, MotionTrigger
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.sensor_models.endpoint import Endpoint
from slam.trajectory import Trajectory

MAX_GAP = 1.0  # s; after a longer gap the robot is predicted to stay where it was
MAX_SEARCH_TIME = 0.5  # s for which the search window grows; a SLAM may correct what it misses
MIN_SPEED_TIME = 0.2  # s over which the speed is measured; over less, stamps jitter too much


@dataclasses.dataclass(frozen=True)
class ConstantVelocity:
    """Constant velocity motion model between two scans.

    acceleration  m/s^2 and rad/s^2, standard deviation
    floor         m and rad, standard deviation of the measured displacement
    """

    acceleration: tuple[float, float] = (2.0, 6.0)
    floor: tuple[float, float] = (0.03, math.radians(1.5))

    def deviations(self, seconds: float) -> Array:
        """(3,) standard deviations of x, y in m and theta in rad."""
        ahead, turned = (
            math.hypot(floor, 0.5 * change * seconds**2)
            for change, floor in zip(self.acceleration, self.floor, strict=True)
        )
        return np.array([ahead, ahead, turned])


class LaserOdometry:
    """Matches each scan with a map of the recent scans, starting at a constant-velocity prediction.

    This is maximum likelihood SLAM (Mitsou and Tzafestas, eq. 7) with constant velocity in place of
    odometry. Its map forgets and its trajectory drifts like odometry; it is meant as the input of a
    SLAM.

    motion  how the robot is taken to move between two scans: `ConstantVelocity`
    """

    def __init__(self, motion: ConstantVelocity = ConstantVelocity()):
        self.motion = motion
        self.pose = Pose2()
        self._map, self._sensor_model, self._search = Recency(), Endpoint(), Correlative()
        self._rng = np.random.default_rng(0)  # not used by the search
        self._past: deque[tuple[float, Pose2]] = deque()
        self._since_keyframe = MotionTrigger(KEYFRAMES)

    def update(self, scan: Scan) -> Pose2:
        """The pose of the robot, in the frame of its first pose."""
        if self._past:
            seconds = scan.time - self._past[-1][0]
            step = self._speed() if seconds <= MAX_GAP else Pose2()
            step = Pose2(*(value * seconds for value in step))
            deviations = self.motion.deviations(min(seconds, MAX_SEARCH_TIME))
            prediction = Prediction(self.pose, step, deviations)
            self.pose = self._search(Posterior(self._sensor_model, scan, prediction), self._rng)
        self._past.append((scan.time, self.pose))
        self._since_keyframe.move_to(self.pose)
        if self._since_keyframe.due(scan.time):
            self._sensor_model.refresh(self._map, self._map.integrate(scan, self.pose))
            self._since_keyframe.restart(scan.time, self.pose)
        return self.pose

    def _speed(self) -> Pose2:
        """m/s and rad/s over the last MIN_SPEED_TIME s at least, in the robot's frame."""
        now, pose = self._past[-1]
        while len(self._past) > 2 and now - self._past[1][0] >= MIN_SPEED_TIME:
            self._past.popleft()
        then, before = self._past[0]
        if not now > then:
            return Pose2()
        return Pose2(*(value / max(now - then, MIN_SPEED_TIME) for value in before.between(pose)))


def poses_by_laser(episode: Episode) -> Iterator[Pose2]:
    """Yield the pose of the robot at each scan, from its first pose on."""
    odometry = LaserOdometry()
    for scan in episode.scans:
        yield odometry.update(scan)


def with_odometry(episode: Episode, poses: list[Pose2]) -> Episode:
    """The episode with `poses` as its odometry."""
    trajectory = Trajectory(episode.times, np.array(poses))
    meta = {**episode.meta, "odometry": "laser"}
    return dataclasses.replace(episode, odometry=trajectory, meta=meta)
