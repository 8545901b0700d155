"""Systematic errors of the odometry that no search around its prediction can follow."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from slam.motion.measured import measured

SCALE_DEVIATION = 0.1  # of the distances that the odometry reports, before anything is learned
SCALE_DRIFT = 0.005  # random walk of their error within a metre
MIN_SCALE_ERROR = 0.1  # smaller errors are not corrected
SIGNIFICANT = 3.0  # standard deviations; less certain ones neither
MAX_SCALE_ERROR = 0.5  # of a single displacement; larger ones are slips
MIN_BIAS = math.radians(90.0)  # per m; smaller ones are within the deviations of the heading
BIAS_SIGNIFICANT = 2.0  # standard deviations; less certain ones are not corrected either
BIAS_DEVIATION = math.radians(120.0)  # per m, before anything is learned
BIAS_REST = math.radians(36.0)  # per m, of an error that no bias explains
FEWEST = 2  # errors, that it is learned from: wheels may slip once
MIN_DRIVEN = 0.05  # m; errors of shorter ways are not of the distance
EXACT = 1e-9  # rad^2, the least variance of a heading
SLIP = 3.0  # standard deviations; larger errors are slips
BIAS_DRIFT = math.radians(6.0)  # per m, random walk of the bias within a metre


class DistanceScale:
    """A Kalman filter of the relative error of the odometry's distances: wrong wheel diameters.

    error      of the distances, as learned so far: true = (1 + error) reported
    variance   of it
    """

    def __init__(self) -> None:
        self.error, self.variance = 0.0, SCALE_DEVIATION**2

    @property
    def factor(self) -> float:
        """Of the distances; 1 as long as no large error is certain."""
        least = max(MIN_SCALE_ERROR, SIGNIFICANT * math.sqrt(self.variance))
        return 1.0 + self.error if abs(self.error) > least else 1.0

    def learn(self, reported: float, measured: float, variance: float) -> None:
        """Update by a reported distance that was measured, m, with a variance, m^2."""
        self.variance += SCALE_DRIFT**2 * reported
        error = measured / reported - 1.0
        if abs(error) > MAX_SCALE_ERROR:
            return
        gain = self.variance / (self.variance + variance / reported**2)
        self.error += gain * (error - self.error)
        self.variance *= 1.0 - gain


class TurnBias:
    """A Kalman filter of the odometry's false turning per metre: unequal wheels.

    error     rad/m, as learned so far: true heading = reported heading + error * distance
    variance  of it
    """

    def __init__(self) -> None:
        self.error, self.variance = 0.0, BIAS_DEVIATION**2
        self._taken = 0  # errors that it was learned from

    @property
    def correction(self) -> float:
        """rad/m to add to the odometry's heading; 0 as long as no large bias is certain."""
        least = max(MIN_BIAS, BIAS_SIGNIFICANT * math.sqrt(self.variance))
        return self.error if self._taken >= FEWEST and abs(self.error) > least else 0.0

    def learn(self, driven: float, error: float, found: float, before: float, rest: float) -> None:
        """Update by a distance `driven`, m, after which the heading was off by `error`, rad.

        found   its variance, which combines scan and prediction
        before  that of the prediction. It is taken out again: where the scan has no information,
                nothing is learned
        rest    that of errors which no bias explains
        """
        if driven < MIN_DRIVEN:
            return
        self.variance += BIAS_DRIFT**2 * driven
        scan = measured(error, max(found, EXACT), before)
        if scan is None:
            return
        off = scan[0] + (self.correction - self.error) * driven
        expected = self.variance * driven**2 + scan[1] + rest
        if off**2 > SLIP**2 * expected:
            return
        gain = self.variance * driven / expected
        self.error += gain * off
        self.variance *= 1.0 - gain * driven
        self._taken += 1


@dataclass
class Systematic:
    """The systematic errors, as learned so far.

    scale  of the distances
    bias   of the heading
    """

    scale: DistanceScale = field(default_factory=DistanceScale)
    bias: TurnBias = field(default_factory=TurnBias)

    @property
    def certain(self) -> bool:
        """Whether one of them is so large, and so certain, that it is corrected."""
        return self.scale.factor != 1.0 or self.bias.correction != 0.0
