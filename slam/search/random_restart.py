"""Hill climbing with random restarts, for likelihoods with several peaks (the paper, 4.3)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.checked import whole
from slam.geometry import Array, Pose2, compose
from slam.interface import Objective
from slam.search.hill_climb import HillClimb


@dataclass(frozen=True)
class RandomRestart:
    """Climbs from the odometry's pose and from `restarts` others drawn from the motion model."""

    restarts: int = 10
    climber: HillClimb = field(default_factory=HillClimb)

    def __post_init__(self) -> None:
        whole(self, "restarts", 0)

    def __call__(
        self, objective: Objective, start: Pose2, deviations: Array, rng: np.random.Generator
    ) -> Pose2:
        """The highest of the peaks that were reached."""
        errors = rng.standard_normal((self.restarts, 3)) * deviations
        starts = np.vstack([[start], compose(start, errors)])
        ends = self.climber.climb(objective, starts)
        return Pose2.of(ends[objective(ends).argmax()])
