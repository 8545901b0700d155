"""Ceilings: mapping with perfect localization, and the reverse (THEORY, section 6).

Both receive the truth of the episode scan by scan; in a benchmark they show whether an error comes
from mapping or from localization. `slam.benchmark.run.build` makes them by name.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.episode import Truth
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.interface import Estimate, MapModel, Slam
from slam.maps.clamped import Clamped
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.maps.true_map import TrueMap, known_moments
from slam.motion.threshold import KEYFRAMES, MotionThreshold, MotionTrigger
from slam.scan import Scan

ShownTruth = Callable[[Truth, np.random.Generator], Slam]
"""Makes a SLAM that receives the truth scan by scan: (truth, random generator) -> Slam."""


class MappingOnly:
    """Mapping from the true poses: the ceiling of a map model.

    Scans are integrated at the same `keyframes` as in the other algorithms.
    """

    def __init__(
        self,
        truth: Truth,
        map_model: MapModel | None = None,
        keyframes: MotionThreshold = KEYFRAMES,
    ):
        self.map_model = Histogram() if map_model is None else map_model
        self.keyframes = keyframes
        self.pose = Pose2.of(truth.poses[0])
        self._since_keyframe = MotionTrigger(keyframes)
        self._moments = known_moments(truth.poses)

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Use the true pose and ignore the odometry; no scan is matched."""
        self.pose = Pose2.of(next(self._moments))
        self._since_keyframe.move_to(self.pose)
        if self._since_keyframe.due(scan.time):
            self.map_model.integrate(scan, self.pose)
            self._since_keyframe.restart(scan.time, self.pose)
        return Estimate(self.pose, np.zeros((3, 3)), 0.0, False)

    def map(self) -> OccupancyGrid:
        """The current occupancy h of every cell."""
        return self.map_model.cells.grid()


class LocalizationOnly:
    """Localization in the true map: the ceiling to compare with the Cramer-Rao bound.

    The map holds walls and doors as they stand at each scan, and is never updated from scans. The
    pose is found by the same search as in maximum likelihood SLAM, without registration, which
    needs surfaces drawn by a robot's own scans.

    matcher  starts at the true pose; its `map_model` is a `TrueMap`
    """

    def __init__(self, matcher: MaximumLikelihood):
        if not isinstance(matcher.map_model, TrueMap):
            wrong = matcher.map_model
            raise InputError(f"LocalizationOnly needs a matcher on a TrueMap, got {wrong}")
        if matcher.registration is not None:
            raise InputError("LocalizationOnly needs a matcher with registration=None")
        self.matcher = matcher
        self.pose = matcher.pose
        self._map_model = matcher.map_model

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Move the doors of the map to their true state, then match the scan."""
        self.matcher.sensor_model.refresh(self._map_model, self._map_model.advance())
        estimate = self.matcher.update(displacement, scan)
        self.pose = estimate.pose
        return estimate

    def map(self) -> OccupancyGrid:
        """The true map at the last scan."""
        return self.matcher.map()


def mapping_only(map_model: Callable[[], MapModel]) -> ShownTruth:
    """A builder of `MappingOnly` with a map model."""
    return lambda truth, rng: MappingOnly(truth, map_model())


def localization_only(truth: Truth, rng: np.random.Generator) -> Slam:
    """`LocalizationOnly` with the default sensor model, motion model and search."""
    start = Pose2.of(truth.poses[0])
    matcher = MaximumLikelihood(start, rng, map_model=TrueMap(truth), registration=None)
    return LocalizationOnly(matcher)


CEILINGS: dict[str, ShownTruth] = {
    "mapping-only": mapping_only(Histogram),
    "mapping-only/static": mapping_only(Static),
    "mapping-only/clamped": mapping_only(Clamped),
    "localization-only": localization_only,
}
"""Ceilings by name; unlike the variants they are built from an episode's truth."""
