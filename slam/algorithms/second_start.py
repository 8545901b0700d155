"""Mapping the first metres again, once it is known how wrong the odometry's distances are."""

from __future__ import annotations

import copy
from typing import Any, Protocol

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import Estimate
from slam.motion.adaptive import AdaptiveOdometry
from slam.scan import Scan
from slam.validation import whole_number


class Restartable(Protocol):
    """A SLAM that can go through its first scans twice."""

    motion_model: Any

    def advance(self, displacement: Pose2, scan: Scan) -> Estimate:
        """One update."""
        ...


NONE = np.zeros((0, 3))


class SecondStart:
    """Goes through the first scans a second time, with the scale of the odometry that they showed.

    Along a bare corridor the scans say little of the distance driven, and a map of the first metres
    is as long as the odometry says. Where its distances turn out to be wrong
    (`AdaptiveOdometry.scale`), that part of the map would stay too long or too short, and the robot
    would be lost in it when it comes back. So it is mapped again, once.

    max_scans  that are kept for it; a robot that stands for so long is not mapped again
    poses      (n, 3) of the first n updates, as they were found the second time; (0, 3) before
    """

    def __init__(self, max_scans: int = 2000):
        whole_number("max_scans", max_scans, 1)
        self.poses: Array = NONE
        self._max_scans = max_scans
        self._fresh: dict[str, Any] = {}  # the state of the SLAM before the first scan
        self._taken: list[tuple[Pose2, Scan]] = []
        self._over = False

    def update(self, slam: Restartable, displacement: Pose2, scan: Scan) -> Estimate:
        """One update of `slam`; if it shows that the scale is wrong, all over again."""
        odometry = slam.motion_model
        if self._over or not isinstance(odometry, AdaptiveOdometry):
            return slam.advance(displacement, scan)
        if not self._taken:
            state = {name: part for name, part in vars(slam).items() if part is not self}
            self._fresh = copy.deepcopy(state, {id(slam): slam})
        self._taken.append((displacement, scan.bare()))
        estimate = slam.advance(displacement, scan)
        if odometry.scale.factor != 1.0:
            estimate = self._again(slam, odometry)
        elif len(self._taken) >= self._max_scans:
            self.stop()
        return estimate

    def stop(self) -> None:
        """From now on nothing is mapped again."""
        self._fresh, self._over = {}, True
        self._taken.clear()

    def _again(self, slam: Restartable, odometry: AdaptiveOdometry) -> Estimate:
        """Map the scans so far again; what they showed of the scale is not learned twice."""
        scale = odometry.scale
        vars(slam).update(self._fresh)
        estimates = []
        for displacement, scan in self._taken:
            slam.motion_model.scale = copy.copy(scale)
            estimates.append(slam.advance(displacement, scan))
        slam.motion_model.scale = scale
        self.poses = np.array([estimate.pose for estimate in estimates])
        self.stop()
        return estimates[-1]._replace(revised=True)
