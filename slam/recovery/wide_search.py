"""Scan matching in a wide window, for keyframes before which the odometry may have failed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.geometry import Pose2
from slam.interface import Posterior
from slam.motion.gaussian import Prediction
from slam.recovery.match import Match
from slam.recovery.places import WIDE, Reach, best_near
from slam.scan import Scan
from slam.search.gauss_newton import GaussNewton
from slam.sensor_models.endpoint import Endpoint
from slam.validation import positive


@dataclass(frozen=True)
class WideSearch:
    """The best pose where the odometry may have failed: a motion model of two Gaussians.

    A displacement is either as the motion model says, or, with a small probability, the wheels
    slipped, or scans or odometry were missing or late, and its error is of the order of a metre.
    The likelihood of the scan decides: the wide pose must explain it so much better that this
    outweighs the density of the narrow Gaussian.

    reach       m, m, rad: half the width of the window around the predicted pose
    deviations  m, m, rad: standard deviations of the error if the odometry failed
    rate        probability that it failed, of a keyframe at which the wide window is searched
    refine      climbs from the best candidate to the local maximum
    """

    reach: Reach = WIDE
    deviations: tuple[float, float, float] = (0.5, 0.5, 0.35)
    rate: float = 0.005
    refine: GaussNewton = field(default_factory=lambda: GaussNewton(levels=2))

    def __post_init__(self) -> None:
        positive(self, "rate")

    def best(
        self, match: Match, failed: Prediction, window: Reach | None = None
    ) -> tuple[Pose2, float]:
        """The best pose of the window, and the log-odds, nats, that the odometry failed and the
        scan was taken there, against where the match found it.

        failed  the prediction if the odometry failed
        window  m, m, rad: half its width, if it is smaller than `reach`
        """
        reach = self.reach if window is None else window
        start = best_near(match.endpoint, match.scan, failed.pose, reach)
        return self.best_at(match, failed, start)

    def best_at(self, match: Match, failed: Prediction, start: Pose2) -> tuple[Pose2, float]:
        """The same of the local maximum near `start`."""
        endpoint, scan = match.endpoint, match.scan
        pose = self.refine.climb(Posterior(endpoint, scan, failed), start)
        there = _log_probability(endpoint, scan, failed, pose) + math.log(self.rate)
        here = _log_probability(endpoint, scan, match.prediction, match.estimate.pose)
        return pose, there - here

    def prior_odds(self, narrow: Prediction, found: Pose2) -> float:
        """The log-odds, nats, that the odometry failed, against `found`, at the predicted pose and
        before scans are compared: those of `best` are larger by what the scan fits better, at
        most."""
        wide = self.around(narrow.pose)
        failed = math.log(self.rate) + _log_prior(wide, wide.pose)
        return failed - _log_prior(narrow, found)

    def around(self, pose: Pose2) -> Prediction:
        """The prediction if the odometry failed: somewhere around a pose."""
        return Prediction(pose, Pose2(), np.array(self.deviations))


def _log_probability(endpoint: Endpoint, scan: Scan, prediction: Prediction, pose: Pose2) -> float:
    """log p(scan, pose), up to a constant that all predictions share."""
    value = endpoint.log_likelihood(scan, np.array([pose]))[0]
    return float(value) + _log_prior(prediction, pose)


def _log_prior(prediction: Prediction, pose: Pose2) -> float:
    """log p(pose), up to a constant that all predictions share."""
    density = prediction.log_density(np.array([pose]))[0]
    return float(density - np.log(prediction.deviations).sum())
