"""Keyframes before which the odometry failed, and where they were taken."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Pose2
from slam.interface import Estimate
from slam.recovery.continuity import Recent
from slam.recovery.lost_belief import Agreement, LostBelief
from slam.recovery.match import Match
from slam.recovery.surprise import Surprise
from slam.recovery.wide_search import WideSearch
from slam.scan import Scan

WORSE = 4.0  # nats by which a scan fits worse than expected: a wide window is searched
MUCH_WORSE = 16.0  # nats; such a match is judged at once
LARGE_ERROR = 2.5  # standard deviations of the odometry, beyond which likewise
AS_USUAL = 0.85  # of the usual share, at least, that the map explains at a pose in that window
MAX_CONTRADICTED = 0.12  # share of the echoes, at most, that it contradicts there,
MORE_CONTRADICTED = 0.05  # or more than usual, at most
GAP = 1.5  # m between keyframes, after which
LEAST_EXPLAINED = 0.3  # of the usual share of explained echoes is asked of a match


class OdometryFailure:
    """Searches a wide window where a scan fits worse than expected, or far from the prediction.

    wide   the search
    moved  whether the last keyframe was found far from the prediction
    """

    def __init__(self, belief: LostBelief, wide: WideSearch):
        """`belief` knows what is usual."""
        self.wide, self._belief, self.moved = wide, belief, False
        self._fits, self._errors = Surprise(WORSE), Surprise(LARGE_ERROR)

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
        self.moved = False
        return self._searched(match, recent) if match.continuous else self._after_gap(match)

    def _searched(self, match: Match, recent: Recent) -> Pose2:
        """The pose of the match, or a better one of the wide window."""
        found, prediction = match.estimate.pose, match.prediction
        suspected = self._fits.surprising(self._worse(match.scan, match.estimate))
        error = np.abs(prediction.error(found)) / prediction.deviations
        far_off = self._errors.surprising(error.max())
        if not (suspected or far_off):
            return found
        pose, odds = self.wide.best(match.endpoint, match.scan, prediction, found)
        likely = odds + recent.evidence(match, pose) > 0.0
        self.moved = likely and self._agrees(match.agreement(pose))
        if self.moved:
            return pose
        if suspected:
            self._fits.dismiss()
        if far_off:
            self._errors.dismiss()
        return found

    def _agrees(self, agreement: Agreement) -> bool:
        """Whether the map agrees with a scan about as usual."""
        most = max(MAX_CONTRADICTED, self._belief.contradicted + MORE_CONTRADICTED)
        enough = agreement.explained > AS_USUAL * self._belief.explained
        return enough and agreement.contradicted <= most

    def _after_gap(self, match: Match) -> Pose2:
        """The pose of the match, or the predicted one: the scan may see new ground."""
        gap = math.dist(match.last[:2], match.prediction.pose[:2]) > GAP
        explained = match.agreement(match.estimate.pose).explained
        seen = explained > LEAST_EXPLAINED * self._belief.explained
        return match.prediction.pose if gap and not seen else match.estimate.pose
