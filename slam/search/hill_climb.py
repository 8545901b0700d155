"""Hill climbing: step to the best neighbour, halve the steps where none is better."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.geometry import Array, Pose2, compose
from slam.interface import Objective

NEIGHBOURS = np.vstack([np.eye(3), -np.eye(3)])


@dataclass(frozen=True)
class HillClimb:
    """Coordinate-wise hill climbing; what the paper uses where doors do not move (section 4.3).

    step, turn            m and rad, first steps
    precision             m, the last step; the turn shrinks in proportion
    """

    step: float = 0.04
    turn: float = math.radians(2.0)
    precision: float = 0.0005

    def __call__(
        self, objective: Objective, start: Pose2, deviations: Array, rng: np.random.Generator
    ) -> Pose2:
        """Climb from `start`."""
        return Pose2.of(self.climb(objective, np.array([start]))[0])

    def climb(self, objective: Objective, starts: Array) -> Array:
        """Climb from all `starts` (n, 3) at once; where each ended (n, 3)."""
        poses, scores = starts.copy(), objective(starts)
        scale = np.full(len(starts), 1.0)
        active = np.arange(len(starts))
        while len(active):
            steps = NEIGHBOURS * (self.step, self.step, self.turn)
            around = compose(poses[active, None], steps * scale[active, None, None])
            values = objective(around.reshape(-1, 3)).reshape(len(active), -1)
            best = values.argmax(axis=1)
            value = np.take_along_axis(values, best[:, None], axis=1)[:, 0]
            better = value > scores[active]
            moved = active[better]
            poses[moved] = around[better, best[better]]
            scores[moved] = value[better]
            scale[active[~better]] /= 2
            active = active[scale[active] * self.step >= self.precision]
        return poses
