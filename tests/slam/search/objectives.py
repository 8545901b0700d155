"""Sensor models of known log-likelihood, and their posteriors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from slam.geometry import Pose2, wrap_angle
from slam.interface import Posterior, Slope
from slam.motion.gaussian import Prediction
from tests.slam.worlds import beam

WIDTH = np.array([0.05, 0.05, 0.05])  # m, m, rad
WIDE = np.array([10.0, 10.0, 10.0])  # a motion model with almost no information


class Peaks:
    """The maximum of some paraboloids: a log-likelihood with a peak at each of `tops` (n, 3).

    heights  (n,) of the peaks
    asked    every array of poses that was asked for
    """

    levels, sharpness = 1, 1.0

    def __init__(self, tops, heights=None, width: Any = WIDTH):
        self.tops = np.atleast_2d(np.asarray(tops, dtype=float))
        self.heights = np.zeros(len(self.tops)) if heights is None else np.asarray(heights)
        self.width = np.asarray(width)
        self.asked: list[np.ndarray] = []

    def refresh(self, map_model, changed):
        """Does nothing."""

    def log_likelihood(self, scan, poses, floor=-math.inf):
        self.asked.append(poses.copy())
        values = self._values(poses)
        return np.where(values < floor, -math.inf, values)

    def slope(self, scan, pose, level=0):
        poses = np.array([pose])
        k = self._each(poses)[0].argmax()
        errors = np.array(pose) - self.tops[k]
        errors[2] = wrap_angle(errors[2])
        curvature = np.diag(-1.0 / self.width**2)
        return Slope(float(self._values(poses)[0]), curvature @ errors, curvature)

    def _values(self, poses):
        return self._each(poses).max(axis=1)

    def _each(self, poses):
        errors = poses[:, None] - self.tops
        errors[..., 2] = wrap_angle(errors[..., 2])
        return self.heights - 0.5 * ((errors / self.width) ** 2).sum(axis=-1)


class Plain(Peaks):
    """No information: exactly the same everywhere."""

    def __init__(self):
        super().__init__((0.0, 0.0, 0.0))

    def _values(self, poses):
        return np.full(len(poses), -3.0)

    def slope(self, scan, pose, level=0):
        return Slope(-3.0, np.zeros(3), np.zeros((3, 3)))


class Stepped(Posterior):
    """Rounded down to whole numbers: many poses are exactly equal."""

    def __call__(self, poses, floor=-math.inf):
        return np.floor(super().__call__(poses, floor))


class Level(Posterior):
    """Rounded down so far that all poses are equal."""

    def __call__(self, poses, floor=-math.inf):
        return np.floor(super().__call__(poses, floor) / 100) * 100


def posterior(
    reading: Any, start=Pose2(), deviations: Any = WIDE, displacement=Pose2(), kind=Posterior
) -> Posterior:
    """A posterior around `start @ displacement`."""
    prediction = Prediction(start, displacement, np.asarray(deviations, dtype=float))
    return kind(reading, beam(1.0), prediction)
