"""The built-in variants, one builder each; two variants differ only in what their names say.

`MAP-ml` is maximum likelihood SLAM on that map model, `MAP-ml/SENSOR` the same with another sensor
model for p(z | s, h). `/beta1` has the paper's weight: every beam counts in full, as if independent
of the others; `/beam` and `/literal` are the two other sensor models that the paper allows. These
three take the pose of the search as it is; all others register the scan with the surfaces of the
map. Five variants replace or leave out another part: `/random-restart` uses the search of the
paper, `/gauss-newton` that of Hector SLAM, `/learned-odometry` corrects a systematic error of the
odometry, `/no-registration` ends with the search, and `/no-recovery` does not notice that the robot
is lost.

`MAP-ml`, `MAP-ml/learned-odometry`, `MAP-ml/no-registration`, `MAP-pf` and `MAP-graph` notice that
the robot is lost, and find it again; the other variants do not. `MAP-pf` is a particle filter over
these maps, `MAP-graph` a graph of local maps: both close loops. `MAP-graph/no-alignment` leaves out
the alignment of the keyframes, with which a graph ends.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.algorithms.graph_slam import GraphSlam
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.algorithms.particle_filter import ParticleFilter
from slam.algorithms.second_start import SecondStart
from slam.geometry import Pose2
from slam.graph.alignment import ALIGNED, Alignment
from slam.interface import Builder, MapModel, MotionModel, Search, SensorModel, Slam
from slam.maps.clamped import Clamped
from slam.maps.filtered import Filtered
from slam.maps.histogram import Histogram
from slam.maps.hmm import HMM
from slam.maps.hybrid import Hybrid
from slam.maps.mean import Mean
from slam.maps.recency import Recency
from slam.maps.static import Static
from slam.maps.temporal import Temporal
from slam.motion.adaptive import AdaptiveOdometry
from slam.motion.learned import LearnedOdometry
from slam.recovery.watch import Watch
from slam.search.correlative import Correlative
from slam.search.gauss_newton import GaussNewton
from slam.search.random_restart import RandomRestart
from slam.search.registration import SURFACES, Registration
from slam.sensor_models.beam import Beam
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.literal import Literal

MAPS: dict[str, Callable[[], MapModel]] = {
    "static": Static,
    "clamped": Clamped,
    "dynamic": Histogram,
    "temporal": Temporal,
    "recency": Recency,
    "hmm": HMM,
    "filtered": Filtered,
    "hybrid": Hybrid,
}
PARTICLE_MAPS = {**MAPS, "dynamic": Mean}  # equal in h, and smaller in memory: one map a particle
del PARTICLE_MAPS["temporal"]  # its windows are not stored in the tiles, which particles share
SENSOR_MODELS: dict[str, Callable[[], SensorModel]] = {
    "/beta1": partial(Endpoint, beta=1.0),
    "/beam": Beam,
    "/literal": Literal,
}


def nobody() -> None:
    """No judgement of whether the robot is lost."""


def maximum_likelihood(
    map_model: Callable[[], MapModel],
    sensor_model: Callable[[], SensorModel] = Endpoint,
    motion_model: Callable[[], MotionModel] = AdaptiveOdometry,
    search: Callable[[], Search] = Correlative,
    registration: Registration | None = SURFACES,
    watch: Callable[[], Watch | None] = Watch,
) -> Builder:
    """A builder of maximum likelihood SLAM; parts not given are those of `MAP-ml`."""

    def build(start: Pose2, rng: np.random.Generator | None = None) -> MaximumLikelihood:
        return MaximumLikelihood(
            start,
            rng,
            map_model=map_model(),
            sensor_model=sensor_model(),
            motion_model=motion_model(),
            search=search(),
            registration=registration,
            watch=watch(),
        )

    return build if watch is nobody else partial(_twice, build)


def particle_filter(
    map_model: Callable[[], MapModel],
    particles: int = 30,
    watch: Callable[[], Watch | None] = Watch,
) -> Builder:
    """A builder of the particle filter over a map model."""

    def build(start: Pose2, rng: np.random.Generator) -> Slam:
        return ParticleFilter(start, rng, map_model=map_model(), particles=particles, watch=watch())

    return build


def graph_slam(
    map_model: Callable[[], MapModel],
    watch: Callable[[], Watch | None] = Watch,
    alignment: Alignment | None = ALIGNED,
) -> Builder:
    """A builder of graph SLAM with a map model for the global map."""

    def build(start: Pose2, rng: np.random.Generator | None = None) -> GraphSlam:
        return GraphSlam(start, rng, map_model=map_model, alignment=alignment, watch=watch())

    return build if watch is nobody else partial(_twice, build)


def _twice(
    build: Callable[..., MaximumLikelihood | GraphSlam], start: Pose2, rng: np.random.Generator
) -> Slam:
    """What `build` makes, with a second start."""
    slam = build(start, rng)
    slam.again = SecondStart(partial(build, start))
    return slam


def dead_reckoning(start: Pose2, rng: np.random.Generator) -> Slam:
    """The odometry alone."""
    return DeadReckoning(start)


def map_variants(
    name: str, map_model: Callable[[], MapModel], particle_map: Callable[[], MapModel] | None
) -> dict[str, Builder]:
    """The variants of one map model: `NAME-ml` with each sensor model, `NAME-pf`, `NAME-graph`.

    particle_map  the map model of the particle filter; None for no `NAME-pf`
    """
    builders = {f"{name}-ml": maximum_likelihood(map_model)}
    for suffix, sensor_model in SENSOR_MODELS.items():
        builders[f"{name}-ml{suffix}"] = maximum_likelihood(
            map_model, sensor_model, registration=None, watch=nobody
        )
    if particle_map is not None:
        builders[f"{name}-pf"] = particle_filter(particle_map)
    builders[f"{name}-graph"] = graph_slam(map_model)
    return builders


BUILDERS: dict[str, Builder] = {"odometry": dead_reckoning}
for _name, _map in MAPS.items():
    BUILDERS |= map_variants(_name, _map, PARTICLE_MAPS.get(_name))
for _name in ("static", "dynamic"):
    _ml = partial(maximum_likelihood, MAPS[_name])
    BUILDERS |= {
        f"{_name}-ml/random-restart": _ml(search=RandomRestart, watch=nobody),
        f"{_name}-ml/gauss-newton": _ml(search=GaussNewton, watch=nobody),
        f"{_name}-ml/learned-odometry": _ml(motion_model=LearnedOdometry),
        f"{_name}-ml/no-registration": _ml(registration=None),
        f"{_name}-ml/no-recovery": _ml(watch=nobody),
        f"{_name}-pf/no-recovery": particle_filter(PARTICLE_MAPS[_name], watch=nobody),
        f"{_name}-graph/no-recovery": graph_slam(MAPS[_name], watch=nobody),
        f"{_name}-graph/no-alignment": graph_slam(MAPS[_name], alignment=None),
    }
