"""Correlative search: every pose of a grid around the odometry's, then refined (Olson 2009)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.checked import positive, whole
from slam.geometry import Array, Pose2, compose
from slam.interface import Objective
from slam.search.hill_climb import HillClimb

FARTHEST = (0.5, 0.5, math.pi)  # m, m, rad: beyond it a leap of the odometry is no motion


@dataclass(frozen=True)
class Correlative:
    """Exhaustive over what the motion model makes likely, so that no peak is missed.

    step, turn  m and rad between neighbouring candidates
    reach       how many standard deviations of the motion are searched
    peaks       how many of the best candidates are refined
    refine      climbs from a candidate to the top of its peak
    """

    step: float = 0.03
    turn: float = math.radians(1.0)
    reach: float = 1.5
    peaks: int = 3
    refine: HillClimb = field(default_factory=lambda: HillClimb(0.015, math.radians(0.5)))

    def __post_init__(self) -> None:
        positive(self, "step", "turn", "reach")
        whole(self, "peaks", 1)

    def __call__(
        self, objective: Objective, start: Pose2, deviations: Array, rng: np.random.Generator
    ) -> Pose2:
        """The best candidate, refined."""
        poses = compose(start, self.candidates(deviations))
        best = np.argsort(-objective(poses), kind="stable")[: self.peaks]
        tops = self.refine.climb(objective, poses[best])
        return Pose2.of(tops[objective(tops).argmax()])

    def candidates(self, deviations: Array) -> Array:
        """(n, 3) displacements from the odometry's pose, a full grid with zero at its centre."""
        reach = np.minimum(self.reach * deviations, FARTHEST).tolist()
        steps = (self.step, self.step, self.turn)
        axes = [_ticks(r, step) for r, step in zip(reach, steps, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _ticks(reach: float, step: float) -> Array:
    n = math.ceil(reach / step)
    return np.arange(-n, n + 1, dtype=np.float64) * step
