"""Watching whether the robot is lost, or its place has changed."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from slam.geometry import Pose2
from slam.interface import Estimate
from slam.motion.gaussian import Prediction
from slam.motion.threshold import MotionThreshold, MotionTrigger
from slam.recovery.astray import GRADUAL, SUDDEN, Demands
from slam.recovery.continuity import Sight, change, sight
from slam.recovery.lost_belief import Agreement, LostBelief
from slam.recovery.places import CANDIDATES, Place, Places, Surroundings, agree, at, matched, near
from slam.recovery.surprise import Surprise
from slam.recovery.wide_search import WideSearch
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

WORSE = 8.0  # nats by which a scan fits worse than expected: a wide window is searched
LARGE_ERROR = 2.5  # standard deviations of the odometry, beyond which likewise
DOUBTED = 0.005  # probability of being lost, above which no keyframe is integrated
CERTAIN = 0.8  # probability of being lost, above which the robot maps apart
CHECKS = MotionThreshold(distance=0.2, turn=math.radians(20.0), time=2.0)
CONTINUOUS = 0.35, math.radians(25.0)  # m, rad, between scans that must be continuous
GAP = 1.5  # m between keyframes, after which
LEAST_EXPLAINED = 0.3  # of the usual share of explained echoes is asked of a match
ELSEWHERE_GAIN = 0.12  # nats a beam by which another place must explain a scan better
JUMP_GAIN = 0.04  # the same, after a scan that was not continuous
MORE_EXPLAINED = 0.1  # share of the echoes, at least, that are explained there and not here
SPREADS = 3.0  # the same, by the usual deviation of that share
AS_USUAL = 0.85  # of the usual share, at least, that another place explains
JUMP_AS_USUAL = 0.7  # the same, after a scan that was not continuous
MAX_CONTRADICTED = 0.12  # share of the echoes, at most, at another place
MORE_CONTRADICTED = 0.05  # than usual, at most, at a pose farther from the prediction
JUMP_MORE_CONTRADICTED = 0.03
JUMP_CONTRADICTED = 0.2  # the same, after a scan that was not continuous
MIN_CHECKS = 3  # in a row that speak against the believed place
MAX_CHECKS = 8  # in a row, after which the place has changed
MAX_SEARCHES, SEARCH_SPACING = 6, 30  # of the whole map in a row; keyframes for one more
POOR = 0.55  # of the usual share; more agrees with the believed place, without a jump
STRANGE_EXPLAINED = 0.25  # of the usual share of explained echoes; fewer agree with no place
STRANGE = 5.0  # usual deviations below the usual share, of such a scan
STRANGE_CONTRADICTED = 0.2  # share of contradicted echoes, at least, of such a scan
ELSEWHERE = 0.45, 0.8, 0.95  # probability of being lost after so many such checks in a row
NOT_ELSEWHERE = 1e-3  # the same after a check that found no better place
UNCHECKED = 0.3  # the largest probability of being lost without them
FOUND = 0.002  # probability of being lost after the robot was found again


class Watch:
    """Tells at every keyframe how probable it is that the robot is lost.

    A place changes piece by piece, while the scan of a robot that was carried changes at once. A
    scan that is not continuous with the one before, or scans that agree ever less with the map,
    raise a doubt. A doubt is settled by a search of the whole map: if no other place explains the
    scans much better, the place has changed; if another does so three times in a row, the robot is
    lost.

    wide    search at keyframes that fit worse than expected: the odometry may have failed
    belief  the probability, and what is usual
    """

    def __init__(self, wide: WideSearch | None = None):
        self.wide = WideSearch() if wide is None else wide
        self.belief = LostBelief()
        self._fits, self._errors = Surprise(WORSE), Surprise(LARGE_ERROR)
        self._before: Sight | None = None
        self._since_check = MotionTrigger(CHECKS)
        self._moved = False  # whether the wide search found the keyframe far from the prediction
        self._jumped = False  # whether the doubt began with a scan that was not continuous
        self._elsewhere = 0  # checks in a row that spoke against the believed place
        self._unsure = False  # whether the last check left the doubt as it was
        self._checks = 0  # in a row that settled nothing
        self._searches = float(MAX_SEARCHES)  # of the whole map that may be made now
        self._way: Pose2 | None = None  # from the believed place to the other, by the last check

    @property
    def doubted(self) -> bool:
        """Whether the pose is too uncertain to integrate the keyframe."""
        return self.belief.probability > DOUBTED

    @property
    def lost(self) -> bool:
        """Whether the robot is lost so certainly that it maps apart."""
        return self._elsewhere >= MIN_CHECKS or self.belief.probability > CERTAIN

    @property
    def demands(self) -> Demands:
        """What is asked of another place, if the robot is lost."""
        demands = SUDDEN if self._jumped else GRADUAL
        return demands._replace(
            contradicted=max(demands.contradicted, self.belief.contradicted + MORE_CONTRADICTED),
            usual=self.belief.explained,
        )

    def told(self, estimate: Estimate) -> Estimate:
        """The estimate with the probability of being lost."""
        return estimate._replace(lost=self.belief.probability)

    def found(self) -> None:
        """The robot was found again."""
        self.belief.set(FOUND)
        self._jumped, self._elsewhere, self._before = False, 0, None

    def surprised(self, scan: Scan, estimate: Estimate) -> bool:
        """Whether a match fits so much worse than expected that it must be judged at once."""
        return not self.doubted and self._fits.surprising(self._worse(scan, estimate))

    def searched(
        self,
        endpoint: Endpoint,
        scan: Scan,
        prediction: Prediction,
        estimate: Estimate,
        last: Pose2,
    ) -> Pose2:
        """The pose of the estimate, a better one farther from the prediction, or the predicted one
        where the map shows too little to match; `last` is the pose of the keyframe before."""
        if not near(last, prediction.pose, *CONTINUOUS):  # it may see new ground
            return self._unless_unmatched(endpoint, scan, prediction, estimate, last)
        error = np.abs(prediction.error(estimate.pose)) / prediction.deviations
        bad_fit = self._fits.surprising(self._worse(scan, estimate))
        far_off = self._errors.surprising(error.max())
        if not (bad_fit or far_off) or self._elsewhere:
            return estimate.pose
        pose = self.wide.better(endpoint, scan, prediction, estimate.pose)
        explained, contradicted = endpoint.shares(scan, pose)
        most = max(MAX_CONTRADICTED, self.belief.contradicted + MORE_CONTRADICTED)
        agrees = explained > AS_USUAL * self.belief.explained and contradicted <= most
        if pose is not estimate.pose and agrees:
            self._moved = True
            return pose
        if bad_fit:
            self._fits.dismiss()
        if far_off:
            self._errors.dismiss()
        return estimate.pose

    def _unless_unmatched(
        self,
        endpoint: Endpoint,
        scan: Scan,
        prediction: Prediction,
        estimate: Estimate,
        last: Pose2,
    ) -> Pose2:
        """The pose of the estimate, or the predicted one if, after a gap, the map shows nearly
        nothing of the scan."""
        explained, _ = endpoint.shares(scan, estimate.pose)
        seen = explained > LEAST_EXPLAINED * self.belief.explained
        gap = math.dist(last[:2], prediction.pose[:2]) > GAP
        return prediction.pose if gap and not seen else estimate.pose

    def _worse(self, scan: Scan, estimate: Estimate) -> float:
        """Nats by which a match fits worse than expected."""
        return (self.belief.score - estimate.score) * len(scan.points)

    def judge(
        self,
        endpoint: Endpoint,
        scan: Scan,
        estimate: Estimate,
        last: Pose2,
        predicted: Pose2,
        surroundings: Callable[[], Surroundings],
    ) -> None:
        """Update the belief by a keyframe, matched with the map of `endpoint`; `last` is the pose
        of the one before, from which the odometry leads to the `predicted` one. Other places are
        searched for in the `surroundings`."""
        moved = last.between(estimate.pose)
        self._searches = min(self._searches + 1.0 / SEARCH_SPACING, MAX_SEARCHES)
        held = self.belief.probability if self._elsewhere or self._unsure else 0.0
        before, self._before, changed = self._before, sight(scan), 0.0
        if before is not None and near(last, predicted, *CONTINUOUS):
            changed = change(before, self._before, moved)
        agreement = Agreement(*endpoint.shares(scan, estimate.pose))
        self.belief.update(agreement, changed, self._moved)
        self._moved = False
        self._since_check.move(moved)
        begins = self.belief.jumped and not self._jumped
        self._jumped = self.doubted and (self._jumped or self.belief.jumped)
        if not self.doubted:
            self._elsewhere, self._unsure = 0, False
        elif begins or self._since_check.due(scan.time):
            self._since_check.restart(scan.time)
            checked = self._checked(agreement, scan, estimate.pose, surroundings)
            self.belief.set(self._settled(checked))
        else:
            self.belief.set(max(min(self.belief.probability, UNCHECKED), held))
        if not self.doubted:
            self.belief.learn(agreement, estimate.score, changed)

    def _settled(self, probability: float) -> float:
        """The probability; a doubt that many checks in a row could not confirm is dropped."""
        self._checks = self._checks + 1 if DOUBTED < probability < ELSEWHERE[-1] else 0
        return probability if self._checks < MAX_CHECKS else NOT_ELSEWHERE

    def _checked(
        self,
        agreement: Agreement,
        scan: Scan,
        pose: Pose2,
        surroundings: Callable[[], Surroundings],
    ) -> float:
        """The probability of being lost, after a search of the whole map."""
        self._unsure = False
        if self.belief.usual(agreement) and self._contradicts_no_more(agreement):
            return self._dismissed()
        if not self._jumped and agreement.explained > POOR * self.belief.explained:
            return self._dismissed()
        endpoint, frame = surroundings()
        here = at(endpoint, scan, frame @ pose)
        other = self._other(endpoint, scan, here)
        if other is not None:
            self._vote(other.pose @ here.pose.inverse(), here.pose)
        elif self._strange(agreement):
            self._elsewhere += 1
        elif not self._contradicts_no_more(agreement):
            self._unsure = True
            return UNCHECKED
        else:
            return self._dismissed()
        if self._jumped or self._elsewhere >= MIN_CHECKS:
            return ELSEWHERE[min(self._elsewhere, MIN_CHECKS) - 1]
        return UNCHECKED

    def _contradicts_no_more(self, agreement: Agreement) -> bool:
        """Whether the map contradicts no more than usual, if that is asked for: after a jump."""
        most = self.belief.contradicted + JUMP_MORE_CONTRADICTED
        return not self._jumped or agreement.contradicted <= most

    def _dismissed(self) -> float:
        """The probability after a check that does not speak against the believed place."""
        self._elsewhere = 0
        self.belief.dismiss()
        return min(self.belief.probability, UNCHECKED) if self._jumped else NOT_ELSEWHERE

    def _other(self, endpoint: Endpoint, scan: Scan, here: Place) -> Place | None:
        """Another place that explains the scan much better: the one that the last check found, or
        one of the whole map."""
        gain = (JUMP_GAIN if self._jumped else ELSEWHERE_GAIN) * len(scan.points)
        spread = 0.0 if self._jumped else SPREADS * self.belief.spread
        more = here.agreement.explained + max(MORE_EXPLAINED, spread)
        if self._elsewhere and self._way is not None:
            before = matched(endpoint, scan, self._way @ here.pose)
            if before.value > here.value + gain and self._agrees(before, more):
                return before
        if self._searches < 1.0:
            return None
        self._searches -= 1.0
        share = JUMP_AS_USUAL if self._jumped else AS_USUAL
        explained = max(share * self.belief.explained, more)
        candidates = CANDIDATES if self._jumped else 1
        places = Places(endpoint, here.pose, candidates=candidates)
        other = places.better_than(scan, here, gain, explained)
        return other if other is not None and self._agrees(other, explained) else None

    def _agrees(self, place: Place, explained: float) -> bool:
        """Whether the map explains more than that share of the scan at a place, and contradicts
        little of it."""
        most = JUMP_CONTRADICTED if self._jumped else MAX_CONTRADICTED
        return place.agreement.explained > explained and place.agreement.contradicted <= most

    def _vote(self, way: Pose2, pose: Pose2) -> None:
        """Count a check that found another place, `way` from the believed `pose`; checks that find
        different places are no agreement."""
        before, self._way = self._way, way
        same = before is not None and agree(way @ pose, before @ pose)
        self._elsewhere = self._elsewhere + 1 if same else 1

    def _strange(self, agreement: Agreement) -> bool:
        """Whether so little agrees that the robot is lost, wherever it may be."""
        belief = self.belief
        least = min(
            STRANGE_EXPLAINED * belief.explained, belief.explained - STRANGE * belief.spread
        )
        return agreement.explained < least and agreement.contradicted > STRANGE_CONTRADICTED
