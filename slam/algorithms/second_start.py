"""Mapping the first metres again, once it is known how wrong the odometry is."""

from __future__ import annotations

import copy
from typing import Any, Protocol

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import Estimate
from slam.motion.adaptive import AdaptiveOdometry
from slam.scan import Scan
from slam.validation import whole_number

NO_POSES = np.zeros((0, 3))


class Beginner(Protocol):
    """A SLAM that can go through its first scans twice."""

    motion_model: Any

    def advance(self, displacement: Pose2, scan: Scan) -> Estimate:
        """One update."""
        ...


class SecondStart:
    """Goes through the first scans a second time, with the errors of the odometry that they showed.

    Along a bare corridor the scans say little of the distance driven, and a map of the first metres
    is as long as the odometry says. Where its distances turn out to be wrong
    (`AdaptiveOdometry.systematic`), that part of the map would stay too long or too short, and the
    robot would be lost in it when it comes back. So it is mapped again, once; likewise where a
    heading turns out to be so wrong that a first scan may have been matched the wrong way round.

    The parts of the SLAM are copied before the first scan, and the copies are used from then on:
    what was changed in a part in the meantime is lost.

    max_scans  that are kept for it; a robot that stands for so long is not mapped again
    poses      (n, 3) of the first n updates, as they were found the second time; (0, 3) before
    """

    def __init__(self, max_scans: int = 2000):
        whole_number("max_scans", max_scans, 1)
        self.max_scans = max_scans
        self.poses: Array = NO_POSES
        self._fresh: dict[str, Any] = {}  # the state of the SLAM before the first scan
        self._taken: list[tuple[Pose2, Scan]] = []
        self._over = False

    def update(self, slam: Beginner, displacement: Pose2, scan: Scan) -> Estimate:
        """One update of `slam`; if it shows that the odometry is wrong, all over again."""
        if not self._taken and not self._over:
            self._prepare(slam)
        if not self._over:
            self._taken.append((displacement, scan.bare()))
        estimate = slam.advance(displacement, scan)
        if not self._over and slam.motion_model.systematic.certain:
            estimate = self._again(slam)
        elif len(self._taken) >= self.max_scans:
            self.stop()
        return estimate

    def stop(self) -> None:
        """From now on nothing is mapped again; the poses stay."""
        self._fresh, self._taken, self._over = {}, [], True

    def _prepare(self, slam: Beginner) -> None:
        """Keep the state before the first scan; without it, nothing is mapped again: no
        error is learned, or parts cannot be copied."""
        state = {name: part for name, part in vars(slam).items() if part is not self}
        if not isinstance(slam.motion_model, AdaptiveOdometry):
            return self.stop()
        try:
            self._fresh = copy.deepcopy(state, {id(slam): slam})
        except TypeError:
            self.stop()

    def _again(self, slam: Beginner) -> Estimate:
        """Map the scans so far again; what they showed of the odometry is not learned twice."""
        learned, taken = slam.motion_model.systematic, self._taken
        vars(slam).update(self._fresh)
        self.stop()
        estimates = []
        for displacement, scan in taken:
            slam.motion_model.systematic = copy.deepcopy(learned)
            estimates.append(slam.advance(displacement, scan))
        slam.motion_model.systematic = learned
        self.poses = np.array([estimate.pose for estimate in estimates])
        return estimates[-1]._replace(revised=True)
