"""Mapping the first metres again, once it is known how wrong the odometry is."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import partial
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

    pose: Pose2
    rng: np.random.Generator
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

    The SLAM begins again with the parts that `build` makes, in the place of its own: what was
    changed in these is lost. Its generator is set back, and draws what it drew.

    build      makes the SLAM once more, as it was before its first scan, without a second start
    max_scans  that are kept for it; a robot that stands for so long is not mapped again
    poses      (n, 3) of the first n updates, as they were found the second time; (0, 3) before
    """

    def __init__(self, build: Callable[[], Beginner], max_scans: int = 2000):
        whole_number("max_scans", max_scans, 1)
        self.max_scans = max_scans
        self.poses: Array = NO_POSES
        self._build: Callable[[], Beginner] | None = build  # None once it is over
        self._start = Pose2()  # of the SLAM before the first scan
        self._rng_state: Any = None  # likewise, of its generator
        self._taken: list[tuple[Pose2, Scan]] = []

    def __getstate__(self) -> dict[str, Any]:
        """A copy has what `build` makes in its place: a function may be one that pickle refuses."""
        build = None if self._build is None else partial(_itself, self._build())
        return vars(self) | {"_build": build}

    def update(self, slam: Beginner, displacement: Pose2, scan: Scan) -> Estimate:
        """One update of `slam`; if it shows that the odometry is wrong, all over again."""
        if not self._taken and self._build is not None:
            self._prepare(slam)
        if self._build is None:
            return slam.advance(displacement, scan)
        self._taken.append((displacement, scan.bare()))
        estimate = slam.advance(displacement, scan)
        if self._build is not None and slam.motion_model.systematic.certain:
            return self._again(slam, self._build())
        if len(self._taken) >= self.max_scans:
            self.stop()
        return estimate

    def stop(self) -> None:
        """From now on nothing is mapped again; the poses stay."""
        self._build, self._taken = None, []

    def _prepare(self, slam: Beginner) -> None:
        """Keep what else the first scan changes; where no error is learned, nothing is mapped
        again."""
        self._start, self._rng_state = slam.pose, slam.rng.bit_generator.state
        if not isinstance(slam.motion_model, AdaptiveOdometry):
            self.stop()

    def _begin(self, slam: Beginner, fresh: Beginner) -> None:
        """Set `slam` back to before its first scan, with the parts of `fresh`."""
        kept = {"pose": self._start, "rng": slam.rng, "again": self}
        slam.rng.bit_generator.state = self._rng_state
        vars(slam).update(vars(fresh) | kept)

    def _again(self, slam: Beginner, fresh: Beginner) -> Estimate:
        """Map the scans so far again; what they showed of the odometry is not learned twice."""
        learned, taken = slam.motion_model.systematic, self._taken
        self._begin(slam, fresh)
        self.stop()
        estimates = []
        for displacement, scan in taken:
            slam.motion_model.systematic = copy.deepcopy(learned)
            estimates.append(slam.advance(displacement, scan))
        slam.motion_model.systematic = learned
        self.poses = np.array([estimate.pose for estimate in estimates])
        return estimates[-1]._replace(revised=True)


def _itself(slam: Beginner) -> Beginner:
    return slam
