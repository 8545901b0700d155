"""Keyframes before which the odometry failed, and where they were taken."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from slam.geometry import Array, Pose2, near
from slam.interface import Estimate
from slam.motion.gaussian import Prediction
from slam.recovery.agreement import Agreement
from slam.recovery.continuity import RECENT, Recent
from slam.recovery.lost_belief import LostBelief
from slam.recovery.match import Match
from slam.recovery.surprise import Surprise
from slam.recovery.wide_search import WideSearch
from slam.scan import Scan

WORSE = 8.0  # nats by which a scan fits worse than expected: a wide window is searched
MUCH_WORSE = 16.0  # nats; such a match is judged at once
LARGE_ERROR = 2.5  # standard deviations of the odometry, beyond which likewise
FALL = 0.04  # share of the echoes by which the overlap with earlier scans falls at once: likewise
SUDDENLY_WORSE = 10.0  # nats by which a scan fits worse than the one before: the robot was carried,
USUAL_FACTOR = 5.0  # and than usual,
STEP_RATE = 0.05  # at which the usual step is learned,
SLIGHT_FALL = 0.02  # if also so large a share of its echoes lies on surfaces that are new,
TURNS, FEW = math.radians(10.0), 10.0  # and, if the robot turned by more, so many of them, which
# the scan before did not see: its beams end elsewhere on walls at a grazing angle
OVERLAP_RATE = 0.05  # at which the usual overlap is learned
ECHO_EVIDENCE = 0.5  # nats of an echo that lies on a surface that a scan before saw
PROVEN = 3.0  # nats by which the scans before must speak for a correction, to prove it,
CERTAIN = 10.0  # or where the map agrees less than usual: a place may have changed
CORRECTED_OVERLAP = 0.04  # by which one of them at least then agrees less than usual, at most,
SEEN_OVERLAP = 0.1  # or, of a large one, if the map contradicts the match, and hardly this one
ANY = slice(None)  # of the last scans: each of them may prove a correction
OLDEST = slice(-2, None)  # of them: these must, where the map contradicts it (see `evidence`)
SLIGHT = 0.42, 0.2  # m and rad; a larger correction is proven by the latest scan
SLIGHT_REACH = 0.42, 0.42, 0.2  # m, m, rad: the window where it cannot prove one
LESS_OVERLAP = 0.15  # by which an earlier scan agrees less than the last one, at most
AS_USUAL = 0.85  # of the usual share, at least, that the map explains at a pose in that window
MAX_CONTRADICTED = 0.12  # share of the echoes, at most, that it contradicts there,
MORE_CONTRADICTED = 0.05  # or more than usual, at most
MORE_EXPLAINED = 0.1  # share, at least, that it explains more there, if it contradicts the match
STRAIGHT = 0.15, 0.15, 0.5  # m, m, rad: deviations of a motion straight on, or as before
NEARBY = 0.3, 0.3, 1.0  # m, m, rad: the window in which one as before is searched for
AGREES = 0.3  # share of a scan that the one before, if that is far away, saw too: nothing failed
LEAST_EXPLAINED = 0.3  # of the usual share of explained echoes, is asked of a match after a gap,
FAR, FAR_EXPLAINED = 2.0, 0.55  # deviations of the odometry, beyond which more is asked


class OdometryFailure:
    """Searches a wide window where a scan fits worse than expected, or far from the prediction.

    wide    the search
    sudden  whether the last keyframe does not follow from the ones before: it fits the map much
            worse than they did, and sees other surfaces, or was found far from the prediction and
            they do not prove it, or by a large correction
    far     whether the last one was corrected by more than SLIGHT
    """

    def __init__(self, belief: LostBelief, wide: WideSearch):
        """`belief` knows what is usual."""
        self.wide, self._belief = wide, belief
        self.sudden = self.far = False
        self._fits, self._falls = Surprise(WORSE), Surprise(FALL)
        self._errors, self._far_fits = Surprise(LARGE_ERROR), Surprise(WORSE)
        self._overlap = 1.0  # usual one, of consecutive keyframes
        self._step = 0.0  # usual change of that, nats
        self._last = math.inf  # nats by which the last keyframe fitted worse than expected

    def moved(self) -> None:
        """The robot is moved by a drift: the next fit is not compared with the last one, as the map
        shows both places."""
        self._last = math.inf

    def evident(self, scan: Scan, estimate: Estimate) -> bool:
        """Whether a match fits much worse than expected, and not as often before."""
        worse = self._worse(scan, estimate)
        return worse > MUCH_WORSE and self._fits.surprising(worse)

    def _worse(self, scan: Scan, estimate: Estimate) -> float:
        """Nats by which a match fits worse than expected."""
        return (self._belief.score - estimate.score) * len(scan.points)

    def corrected(self, match: Match, recent: Recent) -> Pose2:
        """The pose of a match, a better one farther from the prediction, or the predicted one if,
        after a gap, the map shows nearly nothing of the scan.

        recent  keyframes before it
        """
        self.sudden = self.far = False
        if match.expected is not None or not (match.continuous or match.after_gap):
            return self._farther(match, recent)
        return self._searched(match, recent) if match.continuous else self._after_gap(match)

    def _searched(self, match: Match, recent: Recent) -> Pose2:
        """The pose of the match, or a better one."""
        found, prediction = match.estimate.pose, match.prediction
        worse = self._worse(match.scan, match.estimate)
        overlaps = recent.overlaps(match, found)
        fall = self.fall(overlaps[:, 0].tolist())
        few = FEW if abs(match.last.between(found).theta) > TURNS else 0.0
        new = fall > SLIGHT_FALL and self._new(overlaps)[0] > few
        self.sudden = self._suddenly(worse) and new
        error = max(abs(deviation) for deviation in prediction.deviating(found))
        signs = (self._fits, worse), (self._falls, fall), (self._errors, error)
        suspected = [sign for sign, value in signs if sign.surprising(value)]
        if not suspected:
            return found
        if worse + self._provable(overlaps) + self.wide.prior_odds(prediction, found) > 0.0:
            for pose, odds in self._candidates(match, recent, overlaps):
                corrected = recent.overlaps(match, pose)
                proof = evidence(overlaps, corrected)
                if odds + proof > 0.0 and self._accepted(match, pose, overlaps, corrected):
                    self.far = not near(found, pose, *SLIGHT)
                    self.sudden = self.far or proof < PROVEN
                    return pose
        for sign in suspected:
            sign.dismiss()
        return found

    def _candidates(
        self, match: Match, recent: Recent, overlaps: Array
    ) -> Iterator[tuple[Pose2, float]]:
        """Poses at which the scan may have been taken, with their log-odds, nats: where the map
        shows it best, and where it sees again what the latest scan saw, as round a corner into what
        the map does not know."""
        failed = self.wide.around(match.prediction.pose)
        large = _may_be_shown_at_once(overlaps)
        yield self.wide.best(match, failed, self.wide.reach if large else SLIGHT_REACH)
        if large:
            yield self.wide.best_at(match, failed, recent.as_seen_last(match))

    def _accepted(self, match: Match, pose: Pose2, overlaps: Array, corrected: Array) -> bool:
        """Whether the map, or the scans before, agree with a correction."""
        found = match.estimate.pose
        slight = near(found, pose, *SLIGHT)
        silent = len(overlaps) >= RECENT and not _may_be_shown_at_once(overlaps)
        if not (slight or silent or _shown_at_once(overlaps, corrected)):
            return False
        there, here = match.agreement(pose), match.agreement(found)
        less = self._overlap - corrected[:, 0].max(initial=0.0)
        proven = less < CORRECTED_OVERLAP and evidence(overlaps, corrected, OLDEST) > CERTAIN
        if proven and there.explained >= here.explained:
            return True
        seen = slight or less < SEEN_OVERLAP
        shown = seen and evidence(overlaps, corrected) > PROVEN
        return (shown and self._relieved(here, there)) or self._agrees(there)

    def _relieved(self, here: Agreement, there: Agreement) -> bool:
        """Whether the map contradicts a scan where it was matched, and hardly where it is
        corrected, and explains more of it there."""
        relieved = self._belief.contradicts_more(here) and not self._contradicts_much(there)
        return relieved and there.explained > here.explained + MORE_EXPLAINED

    def _provable(self, overlaps: Array) -> float:
        """Nats by which the last scans may speak for a correction, by how much less than usual they
        overlap; twice as much, since a corrected scan may overlap more than usual."""
        return 2.0 * ECHO_EVIDENCE * float(self._new(overlaps).max(initial=0.0))

    def _new(self, overlaps: Array) -> Array:
        """(k,) the number of echoes, more than usual, that each of the last scans did not see."""
        return (self._overlap - overlaps[:, 0]) * overlaps[:, 1]

    def _suddenly(self, worse: float) -> bool:
        """Whether a match fits so much worse than the one before as is not usual."""
        step, self._last = worse - self._last, worse
        sudden = step > max(SUDDENLY_WORSE, USUAL_FACTOR * self._step)
        if math.isfinite(step) and not sudden:
            self._step += (abs(step) - self._step) * STEP_RATE
        return sudden

    def fall(self, overlaps: list[float]) -> float:
        """By how much more the overlap falls at one of the last scans than at any other one."""
        if len(overlaps) < RECENT:
            return 0.0
        self._overlap += (overlaps[0] - self._overlap) * OVERLAP_RATE
        before = [self._overlap, *overlaps]
        second, first = sorted(a - b for a, b in zip(before, overlaps, strict=False))[-2:]
        return first - max(second, 0.0)

    def _agrees(self, agreement: Agreement) -> bool:
        """Whether the map agrees with a scan about as usual."""
        enough = agreement.explained > AS_USUAL * self._belief.explained
        return enough and not self._contradicts_much(agreement)

    def _contradicts_much(self, agreement: Agreement) -> bool:
        """Whether the map contradicts more of a scan than doors do."""
        most = max(MAX_CONTRADICTED, self._belief.contradicted + MORE_CONTRADICTED)
        return agreement.contradicted > most

    def _farther(self, match: Match, recent: Recent) -> Pose2:
        """The pose of the match, or a better one that the scan before proves: near the prediction;
        or where the robot went on as before, as odometry that jumped may tell of no motion; or, if
        scans are far apart, where it drove straight on."""
        found = match.estimate.pose
        overlaps = recent.overlaps(match, found)
        worse = self._worse(match.scan, match.estimate)
        if not len(overlaps) or worse < WORSE:
            return found
        agreeing = overlaps[0].prod() / len(match.scan.pieces)
        suspected = match.expected is not None or agreeing < AGREES
        if not (self._far_fits.surprising(worse) or suspected):
            return found
        motion, window, least = match.expected, NEARBY, PROVEN
        if motion is None:
            driven = math.dist(match.last[:2], match.prediction.pose[:2])
            motion, window, least = Pose2(driven, 0.0, 0.0), None, CERTAIN
        other = Prediction(match.last @ motion, Pose2(), np.array(STRAIGHT))
        wide = self.wide.around(match.prediction.pose)
        pose, odds = self.wide.best(match, other, window)
        elsewhere, odds_there = self.wide.best(match, wide)
        if odds_there > odds:
            pose, odds, least = elsewhere, odds_there, CERTAIN
        proof = _gained(overlaps, recent.overlaps(match, pose))
        explains = match.agreement(pose).explained >= match.agreement(found).explained
        if proof < PROVEN or odds + proof < least or not explains:
            self._far_fits.dismiss()
            return found
        self.sudden = self.far = not near(found, pose, *SLIGHT)
        return pose

    def _after_gap(self, match: Match) -> Pose2:
        """The pose of the match, or the predicted one: the scan may see new ground."""
        found, prediction = match.estimate.pose, match.prediction
        far = math.hypot(*prediction.deviating(found)) > FAR
        least = (FAR_EXPLAINED if far else LEAST_EXPLAINED) * self._belief.explained
        seen = match.agreement(found).explained > least
        return prediction.pose if match.after_gap and not seen else found


def _shown_at_once(found: Array, corrected: Array) -> bool:
    """Whether the latest scan proves a correction, by how many echoes more agree with it: a large
    failure of the odometry shows at once, while a door that moves before the laser hides more and
    more of what the older scans saw."""
    return len(found) >= RECENT and _gained(found, corrected) > CERTAIN


def _gained(found: Array, corrected: Array) -> float:
    """Nats by which the latest scan speaks for a correction."""
    more = corrected[0, 0] * corrected[0, 1] - found[0, 0] * found[0, 1]
    return ECHO_EVIDENCE * float(more)


def _may_be_shown_at_once(found: Array) -> bool:
    """Whether so many echoes disagree with the latest scan that it may prove a large correction."""
    if len(found) < RECENT:
        return False
    return ECHO_EVIDENCE * float((1.0 - found[0, 0]) * found[0, 1]) > CERTAIN


def evidence(found: Array, corrected: Array, asked: slice = ANY) -> float:
    """Log-likelihood ratio, nats, of a correction, by the overlaps (k, 2) of the last scans where
    the match found the scan, and where it is corrected: if the odometry failed after one of them,
    that one agrees better with the corrected pose. This does not depend on the map, in which a room
    may look like itself turned around.

    Fewer than RECENT scans prove no correction, but the latest one may disprove it.

    asked  which of the scans may prove it: the latest ones may see a person walk along
    """
    if len(found) < RECENT:
        return min(_gained(found, corrected), 0.0) if len(found) else 0.0
    possible = corrected[asked, 0] > found[0, 0] - LESS_OVERLAP
    gains = (corrected[asked, 0] - found[asked, 0]) * corrected[asked, 1]
    return ECHO_EVIDENCE * float(gains[possible].max(initial=-found[0, 1]))
