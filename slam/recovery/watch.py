"""Watching whether the robot is lost, or its place has changed."""

from __future__ import annotations

import math
from collections.abc import Callable

from slam.geometry import Pose2
from slam.graph.local_map import Keyframe
from slam.interface import Estimate
from slam.motion.threshold import MotionThreshold, MotionTrigger
from slam.recovery.agreement import Agreement
from slam.recovery.continuity import Recent
from slam.recovery.demands import GRADUAL, SUDDEN, Demands
from slam.recovery.lost_belief import LostBelief
from slam.recovery.match import Match
from slam.recovery.odometry_failure import OdometryFailure
from slam.recovery.pace import Pace
from slam.recovery.places import Surroundings, at
from slam.recovery.rivals import (
    AFTER_CORRECTION,
    AFTER_FADE,
    AFTER_JUMP,
    AFTER_TURN,
    LEAST_USUAL,
    WITHOUT_JUMP,
    Check,
    Proof,
    Rivals,
    around,
)
from slam.recovery.signs import Sign
from slam.recovery.wide_search import WideSearch
from slam.scan import Scan

DOUBTED = 0.005  # probability of being lost, above which no keyframe is integrated
CERTAIN = 0.8  # probability of being lost, above which the robot maps apart
STARTLING = 0.06  # change of a scan since the last keyframe, if the robot hardly moved
CHECKS = MotionThreshold(distance=0.2, turn=math.radians(20.0), time=2.0)
MISPLACED = 2  # searches in a row by which what was drawn last lies elsewhere
MIN_VOTES = 3  # for the same place, against the believed one
MAX_CHECKS = 8  # in a row that settle nothing, after which the place has changed,
MOST_CHECKS = 16  # or, if the scans fit much better at another place all together, after so many
LAST_CHECK = 16  # the same, of ground that was well known: if the map still disagrees, it is lost
WELL_KNOWN = 0.95  # share that the map, with itself, explains of a scan on ground that it knew well
DISAGREES = 0.8, 0.1, 0.5  # it disagrees if it explains less, contradicts so much more than usual,
# and knows so much of the scan at least
FAR_LESS_EXPLAINED = 3.0  # usual deviations below the usual share: not so sure after a jump
MAX_WAITING = 10  # matches in a row, with which the map hardly agrees, that wait to be drawn
FOUND_CONTRADICTED = 0.05  # more than usual, at most, where a lost robot is found
MOST_CONTRADICTED = 0.25  # whatever is usual: a map that contradicts more proves no place
POOR = 0.55  # of the usual share; more agrees with the believed place, less not with it once torn
TORN = 0.4  # change of the scan with which a doubt began: more than doors make
STRANGE_CONTRADICTED = 0.2  # share of contradicted echoes, at least, of a scan that fits no place
ELSEWHERE = 0.45, 0.8, 0.95  # probability of being lost after so many votes
NOT_ELSEWHERE = 1e-3  # the same after a check that found no better place
UNCHECKED = 0.3  # the largest probability of being lost without votes
GAP_DEVIATIONS = 4.0  # of the odometry: after a gap in the scans the robot is not farther off
DROPPED = 0.02  # probability that a dropped doubt was right: 2 of 87 were
NOT_FOUND = 0.6  # the same of a robot that seemed to be carried, and was found nowhere
FORGETTING = 0.99  # factor of it from one keyframe to the next
UNNOTICED, DRIFT = 2.0, 0.03  # m, and share of the way: where each scan followed from the one
# before, the robot is not farther off
LONG_WAY = 100.0  # m: on a shorter one errors do not add up to what old ground contradicts
FOUND = 0.002  # probability of being lost after the robot was found again


class Watch:
    """Tells at every keyframe how probable it is that the robot is lost.

    A place changes piece by piece, while the scan of a robot that was carried changes at once. A
    sign of that, or scans that agree ever less with the map, raise a doubt. A doubt is settled by a
    search of the whole map: if no other place explains the scans much better, the place has
    changed; if another does so three times, or if the map goes on to disagree with ground that it
    knew well, the robot is lost.

    belief     the probability, and what is usual
    odometry   tells where it failed
    pace       of the robot: tells where its odometry jumped
    wide       the search around the predicted pose after a failure of the odometry
    suspected  searches in a row by which what was drawn last lies elsewhere (`OldGround`)
    open       whether a doubt was dropped, and old ground has not agreed with the robot since
    arriving   whether it came from new ground, and old ground has not agreed with it since; None:
               nobody tells
    """

    def __init__(self, wide: WideSearch | None = None):
        self.belief = LostBelief()
        self.odometry = OdometryFailure(self.belief, WideSearch() if wide is None else wide)
        self.pace = Pace()
        self._rivals = Rivals()
        self._recent = Recent()
        self.suspected = 0
        self.open = self._unsettled = False
        self.arriving: bool | None = False
        self._since_check = MotionTrigger(CHECKS)
        self._last: Scan | None = None  # of the last keyframe
        self._jump: Keyframe | None = None  # with which the doubt began, if there was a sign,
        self._before_jump: Keyframe | None = None  # and the one before
        self._unexplained = False  # whether the map showed nearly nothing of that one
        self._torn = False  # whether that one changed by more than TORN
        self._sign = Sign.SCAN  # which one
        self._moved = False  # whether a scan since then was found far from where it was matched
        self._within: tuple[float, float] | None = None  # m, rad: it began after a gap in the scans
        self._startled = False  # whether a scan that was not matched has changed since
        self._unsure = False  # whether the last check left the doubt as it was
        self._checks = 0  # in a row that settled nothing
        self._dropped = 0.0  # probability that a doubt which is over was right
        self._driven = 0.0  # m, of the whole way; inf once it was lost, or was placed
        self._disagreeing = 0  # matches in a row with which the map hardly agrees

    @property
    def doubted(self) -> bool:
        """Whether the pose is too uncertain to integrate the keyframe."""
        return self.belief.probability > DOUBTED

    @property
    def withheld(self) -> bool:
        """Whether the last keyframes are not integrated yet."""
        waits = 0 < self._disagreeing <= MAX_WAITING
        return self.doubted or waits

    @property
    def lost(self) -> bool:
        """Whether the robot is lost so certainly that it maps apart."""
        return self._rivals.votes >= MIN_VOTES or self.belief.probability > CERTAIN

    @property
    def demands(self) -> Demands:
        """What is asked of another place, if the robot is lost."""
        demands = GRADUAL if self._jump is None else SUDDEN
        usual = min(self.belief.contradicted + FOUND_CONTRADICTED, MOST_CONTRADICTED)
        continuous = self._jump is None or self._sign is Sign.TURN
        return demands._replace(
            contradicted=max(demands.contradicted, usual),
            torn=self._torn,
            usual=max(self.belief.explained, LEAST_USUAL),
            continuous=continuous,
            within=self._within or (None if math.isinf(self._reach) else (self._reach, math.pi)),
            likely=self._drift if continuous and self._may_close_loop else math.inf,
            no_new_ground=self.suspected > 0,
        )

    def told(self, estimate: Estimate) -> Estimate:
        """The estimate with the probability of being lost."""
        suspected = UNCHECKED if self.suspected else 0.0
        return estimate._replace(lost=max(self.belief.probability, self._dropped, suspected))

    def glanced(self, estimate: Estimate, scan: Scan, displacement: Pose2) -> Estimate:
        """The same for a scan that is not matched, `displacement` after the last keyframe: if it
        changed much, the robot may be elsewhere, or its odometry be late."""
        startling = self._recent.change(scan, displacement) > STARTLING
        self._startled = self._startled or startling
        told = self.told(estimate)
        return told._replace(lost=max(told.lost, UNCHECKED)) if startling else told

    def placed(self) -> None:
        """The robot was put somewhere, by hand or as it was found there, and may be elsewhere."""
        self._driven, self._last = math.inf, None

    @property
    def _reach(self) -> float:
        """m, from the believed place, within which the robot is by what raised the doubt: after a
        scan that was not continuous, or if old ground disagrees, it may be anywhere."""
        return math.inf if self._jump is not None or self.suspected else self._drift

    @property
    def _told_by_map(self) -> bool:
        """Whether the doubt began with a sign that only the map gave."""
        return self._sign is not Sign.SCAN

    @property
    def _may_close_loop(self) -> bool:
        """Whether the robot comes to old ground after so long a way that errors may have added up
        to what disagrees."""
        return bool(self.arriving) and self._driven > LONG_WAY

    @property
    def _drift(self) -> float:
        """m, from the believed place, within which the robot is if it was not carried."""
        return UNNOTICED + DRIFT * self._driven

    def found(self, sure: bool) -> None:
        """The robot was found again, or, not `sure`, goes on on new ground."""
        self.belief.set(FOUND)
        unsure = UNCHECKED if self._jump is None else NOT_FOUND
        self._dropped, self._unsettled = 0.0 if sure else unsure, not sure
        self.suspected, self.open = 0, False
        self.arriving = None if self.arriving is None else False
        self._trust()
        self._recent.clear()
        self._last = None

    def _trust(self) -> None:
        """No doubt is left."""
        self._jump = self._before_jump = None
        self._checks = 0
        self._sign = Sign.SCAN
        self._unsure = self._unexplained = self._torn = self._moved = False
        self._rivals.clear()

    def surprised(self, scan: Scan, estimate: Estimate) -> bool:
        """Whether a match fits so much worse than expected that it is judged at once."""
        return not self.doubted and self.odometry.evident(scan, estimate)

    def corrected(self, match: Match) -> Pose2:
        """The pose of a match, or a better one if the odometry failed."""
        if self._rivals.votes:
            return match.estimate.pose
        return self.odometry.corrected(match, self._recent)

    def judge(self, match: Match, surroundings: Callable[[], Surroundings]) -> None:
        """Update the belief by a keyframe; other places are searched for in the `surroundings`."""
        pose = match.estimate.pose
        held = self.belief.probability if self._rivals.votes or self._unsure else 0.0
        if not self.doubted:
            self._within = match.prediction.within(GAP_DEVIATIONS) if match.after_gap else None
        agreement, changed = match.agreement(pose), self._recent.add(match)
        waits = match.continuous and self.belief.hardly_agrees(agreement)
        self._disagreeing = self._disagreeing + 1 if waits else 0
        startled = self._startled and self.belief.contradicts_more(agreement)
        sudden = self.odometry.sudden or startled
        arriving = self.arriving is not False
        self.belief.update(agreement, changed, sudden, match.continuous, arriving)
        self._startled = False
        self._rivals.keyframe()
        if not self.open:
            self._dropped *= FORGETTING
        self._since_check.move(match.last.between(pose))
        self._driven += math.dist(match.last[:2], pose[:2])
        sign, begins = self.belief.sign, False
        if sign is not None and (self._jump is None or (self._told_by_map and sign is Sign.SCAN)):
            begins, self._sign = True, sign
            self._jump = Keyframe(match.scan, pose)
            self._before_jump = self._last and Keyframe(self._last, match.last)
            self._unexplained = self.belief.hardly_explains(agreement)
            self._torn = changed > TORN
        self._moved = self._moved or self.odometry.far
        self._last = match.scan
        if not self.doubted:
            self._trust()
        elif begins or self._since_check.due(match.scan.time):
            self._since_check.restart(match.scan.time)
            checked = self._checked(agreement, match.scan, pose, surroundings)
            self.belief.set(self._settled(checked, match.scan, pose, surroundings))
        else:
            self.belief.set(max(min(self.belief.probability, UNCHECKED), held))
        self.odometry.sudden = self.odometry.far = False
        if not self.doubted:
            self.belief.learn(agreement, match.estimate.score, changed)
        if self.suspected >= MISPLACED:
            self.belief.set(ELSEWHERE[-1])

    def _settled(
        self,
        probability: float,
        scan: Scan,
        pose: Pose2,
        surroundings: Callable[[], Surroundings],
    ) -> float:
        """The probability; a doubt that many checks in a row could not confirm is dropped, but the
        robot is lost where the map still disagrees after the most checks."""
        self._checks = self._checks + 1 if DOUBTED < probability < ELSEWHERE[-1] else 0
        if self._checks < (MOST_CHECKS if self._rivals.leading else MAX_CHECKS):
            return probability
        if self._disagrees(scan, pose, surroundings):
            return probability if self._checks < LAST_CHECK else ELSEWHERE[-1]
        self._dropped, self._unsettled = max(self._dropped, DROPPED), True
        return NOT_ELSEWHERE

    def take_unsettled(self) -> bool:
        """Whether a doubt was dropped, or the robot went on on new ground, since this was asked for
        last."""
        unsettled, self._unsettled = self._unsettled, False
        return unsettled

    def _disagrees(self, scan: Scan, pose: Pose2, surroundings: Callable[[], Surroundings]) -> bool:
        """Whether the doubt began with a jump on ground that the map knew well, and the map now
        explains too little of the scan and contradicts too much of it: new ground is not known."""
        if self._before_jump is None:
            return False
        (endpoint, frame), last = surroundings(), self._before_jump
        before = at(endpoint, last.scan, frame @ last.pose).agreement
        now = at(endpoint, scan, frame @ pose).agreement
        most_explained, more, known = DISAGREES
        usual = max(self.belief.contradicted, before.contradicted)
        contradicted = now.contradicted > usual + more and sum(now) > known
        return before.explained > WELL_KNOWN and contradicted and now.explained < most_explained

    def _checked(
        self,
        agreement: Agreement,
        scan: Scan,
        pose: Pose2,
        surroundings: Callable[[], Surroundings],
    ) -> float:
        """The probability of being lost, after a search of the whole map."""
        self._unsure = False
        open_question = self._moved or self._rivals.leading
        if self._agrees(agreement) and not open_question:
            return self._dismissed()
        endpoint, frame = surroundings()
        here = at(endpoint, scan, frame @ pose)
        if self._told_by_map:  # where a loop closes with a drift, the map shows the scan beside it
            beside = around(endpoint, scan, here.pose)
            here = here._replace(value=max(here.value, beside.value))
        strange = self._strange(agreement)
        jump = None if strange or self._jump is None else self._jump.seen_from(pose)
        votes = self._rivals.votes
        check = Check(endpoint, scan, here, self.belief, self._proof(), jump, self._reach)
        against = self._rivals.vote(check)
        if strange:
            self._rivals.votes = votes + 1
        elif not against and (self._told_by_map or self._hardly_doubted(agreement)):
            return self._dismissed()
        elif not against:
            self._unsure = True
            return UNCHECKED
        if self._jump is not None or self._rivals.votes >= MIN_VOTES:
            return ELSEWHERE[min(self._rivals.votes, MIN_VOTES) - 1]
        return UNCHECKED

    def _proof(self) -> Proof:
        """What is asked of another place."""
        if self._jump is None:
            return WITHOUT_JUMP
        after_scan = AFTER_CORRECTION if self._moved else AFTER_JUMP
        return {Sign.TURN: AFTER_TURN, Sign.FADE: AFTER_FADE}.get(self._sign, after_scan)

    def _agrees(self, agreement: Agreement) -> bool:
        """Whether the map agrees with the scan so well that no other place is searched for."""
        if self.belief.usual(agreement) and self._contradicts_no_more(agreement):
            return True
        return self._jump is None and agreement.explained > POOR * self.belief.explained

    def _hardly_doubted(self, agreement: Agreement) -> bool:
        """Whether nothing speaks against the believed place: no other one leads and, after a jump,
        the map contradicts no more than usual, and explains not far less."""
        belief = self.belief
        least = belief.explained - FAR_LESS_EXPLAINED * belief.spread
        return not self._rivals.leading and (
            self._jump is None
            or (not belief.contradicts_more(agreement) and agreement.explained > least)
        )

    def _contradicts_no_more(self, agreement: Agreement) -> bool:
        """Whether the map contradicts no more than usual, if that is asked for: after a jump."""
        return self._jump is None or not self.belief.contradicts_more(agreement)

    def _dismissed(self) -> float:
        """The probability after a check that does not speak against the believed place."""
        self._rivals.clear()
        if self._jump is not None:
            self.belief.dismiss(self._sign)
        return NOT_ELSEWHERE

    def _strange(self, agreement: Agreement) -> bool:
        """Whether so little agrees that the robot is lost, wherever it may be."""
        if self._torn and agreement.explained < POOR * self.belief.explained:
            return self.belief.contradicts_more(agreement)
        if not self.belief.hardly_explains(agreement):
            return False
        if self._unexplained:
            return self.belief.contradicts_more(agreement)
        return agreement.contradicted > STRANGE_CONTRADICTED
