"""The variants that dynslam knows from the start, each a builder; equal but for what they name.

`/beta1` is the paper's weight: every beam counts in full, as if independent of the others.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.geometry import Pose2
from slam.interface import Builder, MapModel, Slam
from slam.maps.clamped import Clamped
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.perception.endpoint import Endpoint


def maximum_likelihood(grid: Callable[[], MapModel], beta: float | None = None) -> Builder:
    """A builder of maximum likelihood SLAM on a map model of one's own; all else as tuned."""

    def build(start: Pose2, rng: np.random.Generator) -> Slam:
        perception = Endpoint() if beta is None else Endpoint(beta=beta)
        return MaximumLikelihood(start, rng, grid=grid(), perception=perception)

    return build


def dead_reckoning(start: Pose2, rng: np.random.Generator) -> Slam:
    """The odometry alone."""
    return DeadReckoning(start)


BUILDERS: dict[str, Builder] = {
    "odometry": dead_reckoning,
    "static-ml": maximum_likelihood(Static),
    "clamped-ml": maximum_likelihood(Clamped),
    "dynamic-ml": maximum_likelihood(Histogram),
    "static-ml/beta1": maximum_likelihood(Static, beta=1.0),
    "clamped-ml/beta1": maximum_likelihood(Clamped, beta=1.0),
    "dynamic-ml/beta1": maximum_likelihood(Histogram, beta=1.0),
}
