"""Watching whether the robot is lost, or its place has changed."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Pose2
from slam.interface import Estimate
from slam.motion.gaussian import Prediction
from slam.motion.threshold import MotionThreshold, MotionTrigger
from slam.recovery.continuity import change
from slam.recovery.lost_belief import Agreement, LostBelief
from slam.recovery.places import Place, Places, at
from slam.recovery.wide_search import WideSearch
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

WORSE = 12.0  # nats by which a scan fits worse than usual: a wide window is searched
LARGE_ERROR = 2.5  # standard deviations of the odometry, beyond which likewise
DOUBTED = 0.005  # probability of being lost, above which no keyframe is integrated
LOST = 0.5  # probability of being lost, above which the robot maps apart
CHECKS = MotionThreshold(distance=0.3, turn=math.radians(30.0), time=2.0)
ELSEWHERE_GAIN = 25.0  # nats by which another place must explain a scan better than the believed
JUMP_GAIN = 10.0  # the same, after a scan that was not continuous
MORE_EXPLAINED = 0.1  # share of the echoes, at least, that are explained there and not here
AS_USUAL = 0.8  # of the usual share, at least, that another place explains
MIN_CHECKS = 3  # in a row that speak against the believed place
STRANGE_EXPLAINED = 0.4  # of the usual share of explained echoes; fewer agree with no place
STRANGE_CONTRADICTED = 0.2  # share of contradicted echoes, at least, of such a scan
ELSEWHERE, NOT_ELSEWHERE = 0.9, 1e-3  # probability of being lost after checks of all places
UNCHECKED = 0.3  # the largest probability of being lost without them
FOUND = 0.002  # probability of being lost after the robot was found again


class Watch:
    """Tells at every keyframe how probable it is that the robot is lost.

    A place changes piece by piece, while the scan of a robot that was carried changes at once. A
    scan that is not continuous with the one before, or scans that agree ever less with the map,
    raise a doubt. A doubt is settled by a search of the whole map: if no other place explains the
    scans much better, the place has changed; if another does so three times in a row, the robot is
    lost.

    wide    search at keyframes that fit worse than usual: the odometry may have failed
    belief  the probability, and what is usual
    """

    def __init__(self, wide: WideSearch | None = None):
        self.wide = WideSearch() if wide is None else wide
        self.belief = LostBelief()
        self._before: Scan | None = None
        self._since_check = MotionTrigger(CHECKS)
        self._jumped = False  # whether the doubt began with a scan that was not continuous
        self._elsewhere = 0  # checks in a row that found another place better

    @property
    def doubted(self) -> bool:
        """Whether the pose is too uncertain to integrate the keyframe."""
        return self.belief.probability > DOUBTED

    @property
    def lost(self) -> bool:
        """Whether the robot is lost."""
        return self.belief.probability > LOST

    def found(self) -> None:
        """The robot was found again."""
        self.belief.set(FOUND)
        self._jumped, self._elsewhere, self._before = False, 0, None

    def searched(
        self, endpoint: Endpoint, scan: Scan, prediction: Prediction, estimate: Estimate
    ) -> Pose2:
        """The pose of the estimate, or a better one farther from the prediction."""
        error = np.abs(prediction.error(estimate.pose)) / prediction.deviations
        worse = (self.belief.score - estimate.score) * len(scan.points)
        if worse <= WORSE and error.max() <= LARGE_ERROR:
            return estimate.pose
        return self.wide.better(endpoint, scan, prediction, estimate.pose)

    def judge(self, endpoint: Endpoint, scan: Scan, estimate: Estimate, last: Pose2) -> None:
        """Update the belief by a keyframe; `last` is the pose of the one before."""
        moved = last.between(estimate.pose)
        changed = 0.0 if self._before is None else change(self._before, scan, moved)
        agreement = Agreement(*endpoint.shares(scan, estimate.pose))
        self.belief.update(agreement, estimate.score, changed)
        self._before = scan
        self._since_check.move(moved)
        self._jumped = self.doubted and (self._jumped or self.belief.jumped)
        if not self.doubted:
            self._elsewhere = 0
        elif self._jumped or self._since_check.due(scan.time):
            self._since_check.restart(scan.time)
            self.belief.set(self._checked(endpoint, scan, estimate.pose))
        else:
            self.belief.set(min(self.belief.probability, UNCHECKED))

    def _checked(self, endpoint: Endpoint, scan: Scan, pose: Pose2) -> float:
        """The probability of being lost, after a search of the whole map."""
        here = at(endpoint, scan, pose)
        other = Places(endpoint, pose).best_but(scan, pose)
        if self._better(other, here) or self._strange(here.agreement):
            self._elsewhere += 1
            return ELSEWHERE if self._elsewhere >= MIN_CHECKS else UNCHECKED
        self._elsewhere = 0
        return min(self.belief.probability, UNCHECKED) if self._jumped else NOT_ELSEWHERE

    def _better(self, other: Place, here: Place) -> bool:
        """Whether the scan was more likely taken at the other place."""
        gain = JUMP_GAIN if self._jumped else ELSEWHERE_GAIN
        return (
            other.value - here.value > gain
            and other.agreement.explained > AS_USUAL * self.belief.explained
            and other.agreement.explained > here.agreement.explained + MORE_EXPLAINED
        )

    def _strange(self, agreement: Agreement) -> bool:
        """Whether so little agrees that the robot is lost, wherever it may be."""
        return (
            agreement.explained < STRANGE_EXPLAINED * self.belief.explained
            and agreement.contradicted > STRANGE_CONTRADICTED
        )
