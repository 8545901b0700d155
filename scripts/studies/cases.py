"""The cases of `dynslam study`: what is varied, one thing at a time."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from dynslam_env import Laser, Odometry, Uniform
from dynslam_env.worlds.loop import Loop
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.algorithms.variants import maximum_likelihood
from slam.benchmark.run import build, true_start
from slam.episode import Episode
from slam.interface import Builder, Slam
from slam.maps.clamped import Clamped
from slam.maps.histogram import Histogram
from slam.maps.hmm import HMM
from slam.maps.static import Static
from slam.motion.threshold import MotionThreshold
from slam.search.gauss_newton import GaussNewton
from slam.search.hill_climb import HillClimb
from slam.search.random_restart import RandomRestart
from slam.sensor_models.beam import Beam
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.literal import Literal

Maker = Callable[[Episode, int], Slam]
MODELS = ("static", "clamped", "dynamic", "recency", "hmm", "filtered", "hybrid")
LAWS: dict[str, Any] = {
    "never": "static",
    "5-20 s": "moving",
    "2-8 s": Uniform(2.0, 8.0),
    "1-3 s": Uniform(1.0, 3.0),
}
NO_SLIP = Odometry(bias=0.0, alpha1=0.0, alpha2=0.0, alpha3=0.0, alpha4=0.0)
NO_NOISE = Laser(sigma=0.0)


class StudyCase(NamedTuple):
    """One line of a study.

    name   what is varied, and how
    make   the SLAM for an episode and a seed
    doors  when they flip: a name of `LAWS`
    world  other parameters of the environment
    env    where is driven
    """

    name: str
    make: Maker
    doors: str = "5-20 s"
    world: tuple[tuple[str, Any], ...] = ()
    env: str = "DoorCorridor-v0"


def named(name: str) -> Maker:
    """A registered variant, or a ceiling."""
    return lambda episode, seed: build(name, episode, seed)


def built(builder: Builder) -> Maker:
    """A variant that has no name."""
    return lambda episode, seed: builder(true_start(episode), np.random.default_rng(seed))


def read(grid: Any = Static, **parameters: Any) -> Maker:
    """A map with the endpoint reading of such parameters."""
    return built(maximum_likelihood(grid, partial(Endpoint, **parameters)))


def searched(search: Callable[[], Any]) -> Maker:
    """Static ML with another search."""
    return built(maximum_likelihood(Static, search=search))


def spaced(distance: float) -> Maker:
    """Static ML with a keyframe so often, m; the turns and times in proportion."""
    keyframes = MotionThreshold(distance, math.radians(100.0) * distance, 20.0 * distance)
    return built(lambda start, rng: MaximumLikelihood(start, rng, keyframes=keyframes))


def models() -> list[StudyCase]:
    """Every map model, doors that stand and doors that move."""
    return [
        StudyCase(f"{model}-ml", named(f"{model}-ml"), doors)
        for doors in ("never", "5-20 s")
        for model in MODELS
    ]


def accuracy() -> list[StudyCase]:
    """Where the error comes from: static ML, one thing changed at a time."""
    fine = partial(Static, resolution=0.025)
    coarse = partial(Static, resolution=0.1)
    return [
        StudyCase("static-ml", named("static-ml")),
        StudyCase("doors stand", named("static-ml"), "never"),
        StudyCase("ceiling: true map, moving doors known", named("localization-only")),
        StudyCase("no range noise", named("static-ml"), world=(("laser", NO_NOISE),)),
        StudyCase("exact odometry", named("static-ml"), world=(("odometry", NO_SLIP),)),
        StudyCase(
            "neither noise nor slip, doors stand",
            named("static-ml"),
            "never",
            (("laser", NO_NOISE), ("odometry", NO_SLIP)),
        ),
        StudyCase("cells of 2.5 cm, sigma 3 cm", read(fine, sigma=0.03)),
        StudyCase("cells of 10 cm, sigma 8 cm", read(coarse, sigma=0.08)),
        StudyCase("sigma 3 cm", read(sigma=0.03)),
        StudyCase("sigma 6 cm", read(sigma=0.06)),
        StudyCase("beta 0.1", read(beta=0.1)),
        StudyCase("beta 1", read(beta=1.0)),
        StudyCase("beta 3", read(beta=3.0)),
        StudyCase("keyframes each 5 cm", spaced(0.05)),
        StudyCase("keyframes each 20 cm", spaced(0.2)),
        StudyCase("keyframes each 40 cm", spaced(0.4)),
        StudyCase("search: hill climbing", searched(HillClimb)),
        StudyCase("search: random restarts", searched(RandomRestart)),
        StudyCase("search: Gauss-Newton alone", searched(GaussNewton)),
        StudyCase("odometry's bias learned", named("static-ml/learned-odometry")),
    ]


def readings() -> list[StudyCase]:
    """Reading x map; the two slow readings with the doors of the paper only, but for the beam's."""
    kinds: dict[str, tuple[Callable[[], Any], tuple[str, ...]]] = {
        "endpoint": (Endpoint, ("never", "5-20 s")),
        "beam": (Beam, ("never", "5-20 s")),
        "literal": (Literal, ("5-20 s",)),
    }
    grids = {"static": Static, "dynamic": Histogram}
    return [
        StudyCase(f"{kind}: {name}", built(maximum_likelihood(grid, reading)), doors)
        for kind, (reading, laws) in kinds.items()
        for doors in laws
        for name, grid in grids.items()
    ]


def rates() -> list[StudyCase]:
    """How often doors flip x map x beta."""
    grids = {"static": Static, "clamped": Clamped, "dynamic": Histogram, "hmm": HMM}
    return [
        StudyCase(f"{name}, beta {beta:g}", read(grid, beta=beta), doors)
        for doors in LAWS
        for beta in (0.3, 1.0)
        for name, grid in grids.items()
    ]


def windows() -> list[StudyCase]:
    """The histogram's windows and bins."""
    cases = [
        StudyCase(f"delta_t {t:g} s", read(partial(Histogram, delta_t=t)), doors)
        for doors in ("5-20 s", "1-3 s")
        for t in (1.0, 2.0, 4.0, 8.0, 16.0, 1000.0)
    ]
    return [*cases, StudyCase("2 bins (equation 9)", read(partial(Histogram, bins=2)))]


def loops() -> list[StudyCase]:
    """What particles and graphs buy where the way leads around a block three times."""
    rounds = (("world", Loop(laps=3)), ("max_episode_steps", 5000))
    still = ["static-ml", "dynamic-ml", "static-graph", "dynamic-graph"]
    every = [*still, "hmm-ml", "hmm-graph", "static-pf", "dynamic-pf"]
    return [
        StudyCase(name, named(name), doors, rounds, "DoorLoop-v0")
        for doors, names in (("never", still), ("5-20 s", every))
        for name in names
    ]


def long() -> list[StudyCase]:
    """A block of 70 x 40 m, twice around: a loop of 210 m, moving doors."""
    block = Loop(length=70.0, breadth=40.0, outer_doors=8, inner_doors=5, laps=2)
    way = (("world", block), ("max_episode_steps", 10_000))
    names = ("static-ml", "dynamic-ml", "hmm-ml", "static-graph", "dynamic-graph")
    return [StudyCase(name, named(name), "5-20 s", way, "DoorLoop-v0") for name in names]


STUDIES: dict[str, Callable[[], list[StudyCase]]] = {
    "models": models,
    "accuracy": accuracy,
    "readings": readings,
    "rates": rates,
    "windows": windows,
    "loops": loops,
    "long": long,
}
