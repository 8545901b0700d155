"""Hill climbing: step to the best neighbour, halve the steps if none is better."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slam.geometry import Array, Pose2
from slam.interface import Posterior
from slam.kernel import kernel
from slam.validation import positive

NEIGHBOURS = 6  # forward and back along x, y and theta of the robot's frame


@dataclass(frozen=True)
class HillClimb:
    """Coordinate-wise hill climbing; what the paper uses where doors do not move (section 4.3).

    step, turn  m and rad, initial steps
    precision   m, final step; the turn shrinks in proportion
    """

    step: float = 0.04
    turn: float = math.radians(2.0)
    precision: float = 0.001

    def __post_init__(self) -> None:
        positive(self, "step", "turn", "precision")

    def __call__(self, posterior: Posterior, rng: np.random.Generator) -> Pose2:
        """Climb from the predicted pose."""
        return Pose2.of(self.climb(posterior, np.array([posterior.prediction.pose]))[0])

    def climb(self, objective: Callable[[Array], Array], starts: Array) -> Array:
        """Climb from all `starts` (n, 3) at once; the (n, 3) poses at which they end."""
        poses, scores = starts.copy(), objective(starts)
        scale = np.ones(len(starts))
        steps = np.array([self.step, self.step, self.turn])
        active = np.arange(len(starts))
        while len(active):
            around = _around(poses, scale, active, steps)
            _move(poses, scores, scale, active, around, objective(around))
            active = active[scale[active] * self.step >= self.precision]
        return poses


@kernel
def _around(poses, scale, active, steps):
    """(len(active) * NEIGHBOURS, 3) the neighbours of the active poses."""
    around = np.empty((len(active) * NEIGHBOURS, 3))
    for n in range(len(active)):
        x, y, theta = poses[active[n]]
        c, s = np.cos(theta), np.sin(theta)
        for axis in range(3):
            by = steps[axis] * scale[active[n]]
            for k in range(2):
                moved = around[n * NEIGHBOURS + 2 * axis + k]
                moved[:] = x, y, theta
                if axis == 0:
                    moved[0] += by * c
                    moved[1] += by * s
                elif axis == 1:
                    moved[0] -= by * s
                    moved[1] += by * c
                else:
                    moved[2] = (theta + by + np.pi) % (2 * np.pi) - np.pi
                by = -by
    return around


@kernel
def _move(poses, scores, scale, active, around, values):
    """Move each active pose to its best neighbour; if none is better, halve its steps."""
    for n in range(len(active)):
        i, first = active[n], n * NEIGHBOURS
        best = first + np.argmax(values[first : first + NEIGHBOURS])
        if values[best] > scores[i]:
            poses[i] = around[best]
            scores[i] = values[best]
        else:
            scale[i] /= 2
