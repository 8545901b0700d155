"""Hill climbing with random restarts, for likelihoods with several peaks (the paper, 4.3)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.geometry import Pose2
from slam.interface import Posterior
from slam.search.hill_climb import HillClimb
from slam.validation import whole


@dataclass(frozen=True)
class RandomRestart:
    """Climbs from the odometry's pose and from others drawn from the motion model.

    restarts  number of those others
    climber   climbs from each
    """

    restarts: int = 10
    climber: HillClimb = field(default_factory=HillClimb)

    def __post_init__(self) -> None:
        whole(self, "restarts", 0)

    def __call__(self, posterior: Posterior, rng: np.random.Generator) -> Pose2:
        """The highest of the peaks that were reached."""
        prediction = posterior.prediction
        errors = rng.standard_normal((1 + self.restarts, 3)) * prediction.deviations
        errors[0] = 0.0
        ends = self.climber.climb(posterior, prediction.poses(errors))
        return Pose2.of(ends[posterior(ends).argmax()])
