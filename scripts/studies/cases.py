"""The cases of `dynslam study`: one thing varied at a time."""

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
MAP_MODELS = ("static", "clamped", "dynamic", "recency", "hmm", "filtered", "hybrid")
DOOR_LAWS: dict[str, Any] = {
    "never": "static",
    "5-20 s": "moving",
    "2-8 s": Uniform(2.0, 8.0),
    "1-3 s": Uniform(1.0, 3.0),
}
EXACT_ODOMETRY = Odometry(bias=0.0, alpha1=0.0, alpha2=0.0, alpha3=0.0, alpha4=0.0)
EXACT_LASER = Laser(sigma=0.0)


class StudyCase(NamedTuple):
    """One row of a study.

    name   the variation
    make   makes the SLAM for an episode and a seed
    doors  when doors move: a name in `DOOR_LAWS`
    world  other parameters of the environment
    env    id of the environment
    """

    name: str
    make: Maker
    doors: str = "5-20 s"
    world: tuple[tuple[str, Any], ...] = ()
    env: str = "DoorCorridor-v0"


def named(name: str) -> Maker:
    """Maker of a registered variant or a ceiling."""
    return lambda episode, seed: build(name, episode, seed)


def built(builder: Builder) -> Maker:
    """Maker of a variant without a name."""
    return lambda episode, seed: builder(true_start(episode), np.random.default_rng(seed))


def with_endpoint(map_model: Any = Static, **parameters: Any) -> Maker:
    """Maker of a map model with an endpoint model of such parameters."""
    return built(maximum_likelihood(map_model, partial(Endpoint, **parameters)))


def with_search(search: Callable[[], Any]) -> Maker:
    """Maker of static ML with another search."""
    return built(maximum_likelihood(Static, search=search))


def with_keyframes(distance: float) -> Maker:
    """Maker of static ML with a keyframe every `distance`, m; angles and times in proportion."""
    keyframes = MotionThreshold(distance, math.radians(100.0) * distance, 20.0 * distance)
    return built(lambda start, rng: MaximumLikelihood(start, rng, keyframes=keyframes))


def models() -> list[StudyCase]:
    """Every map model, with static and with moving doors."""
    return [
        StudyCase(f"{model}-ml", named(f"{model}-ml"), doors)
        for doors in ("never", "5-20 s")
        for model in MAP_MODELS
    ]


def accuracy() -> list[StudyCase]:
    """Sources of the error: static ML, one thing changed at a time."""
    fine = partial(Static, resolution=0.025)
    coarse = partial(Static, resolution=0.1)
    return [
        StudyCase("static-ml", named("static-ml")),
        StudyCase("static doors", named("static-ml"), "never"),
        StudyCase("ceiling: true map, moving doors known", named("localization-only")),
        StudyCase("no range noise", named("static-ml"), world=(("laser", EXACT_LASER),)),
        StudyCase("exact odometry", named("static-ml"), world=(("odometry", EXACT_ODOMETRY),)),
        StudyCase(
            "neither noise nor slip, static doors",
            named("static-ml"),
            "never",
            (("laser", EXACT_LASER), ("odometry", EXACT_ODOMETRY)),
        ),
        StudyCase("cells of 2.5 cm, sigma 3 cm", with_endpoint(fine, sigma=0.03)),
        StudyCase("cells of 10 cm, sigma 8 cm", with_endpoint(coarse, sigma=0.08)),
        StudyCase("sigma 3 cm", with_endpoint(sigma=0.03)),
        StudyCase("sigma 6 cm", with_endpoint(sigma=0.06)),
        StudyCase("beta 0.1", with_endpoint(beta=0.1)),
        StudyCase("beta 1", with_endpoint(beta=1.0)),
        StudyCase("beta 3", with_endpoint(beta=3.0)),
        StudyCase("keyframes each 5 cm", with_keyframes(0.05)),
        StudyCase("keyframes each 20 cm", with_keyframes(0.2)),
        StudyCase("keyframes each 40 cm", with_keyframes(0.4)),
        StudyCase("search: hill climbing", with_search(HillClimb)),
        StudyCase("search: random restarts", with_search(RandomRestart)),
        StudyCase("search: Gauss-Newton alone", with_search(GaussNewton)),
        StudyCase("odometry's bias learned", named("static-ml/learned-odometry")),
    ]


def readings() -> list[StudyCase]:
    """Sensor model x map; the slow literal model with the doors of the paper only."""
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
    """Rate of the doors x map x beta."""
    grids = {"static": Static, "clamped": Clamped, "dynamic": Histogram, "hmm": HMM}
    return [
        StudyCase(f"{name}, beta {beta:g}", with_endpoint(grid, beta=beta), doors)
        for doors in DOOR_LAWS
        for beta in (0.3, 1.0)
        for name, grid in grids.items()
    ]


def windows() -> list[StudyCase]:
    """Windows and bins of the histogram."""
    cases = [
        StudyCase(f"delta_t {t:g} s", with_endpoint(partial(Histogram, delta_t=t)), doors)
        for doors in ("5-20 s", "1-3 s")
        for t in (1.0, 2.0, 4.0, 8.0, 16.0, 1000.0)
    ]
    return [*cases, StudyCase("2 bins (equation 9)", with_endpoint(partial(Histogram, bins=2)))]


def loops() -> list[StudyCase]:
    """Particle filters and graphs on three laps around a block."""
    rounds = (("world", Loop(laps=3)), ("max_episode_steps", 5000))
    still = ["static-ml", "dynamic-ml", "static-graph", "dynamic-graph"]
    every = [*still, "hmm-ml", "hmm-graph", "static-pf", "dynamic-pf"]
    return [
        StudyCase(name, named(name), doors, rounds, "DoorLoop-v0")
        for doors, names in (("never", still), ("5-20 s", every))
        for name in names
    ]


def long() -> list[StudyCase]:
    """Two laps around a block of 70 x 40 m, a loop of 210 m, with moving doors."""
    block = Loop(length=70.0, breadth=40.0, outer_doors=8, inner_doors=5, laps=2)
    world = (("world", block), ("max_episode_steps", 10_000))
    names = ("static-ml", "dynamic-ml", "hmm-ml", "static-graph", "dynamic-graph")
    return [StudyCase(name, named(name), "5-20 s", world, "DoorLoop-v0") for name in names]


def covariance() -> list[StudyCase]:
    """Every kind of SLAM in every world, with the paper's odometry and with a good one."""
    good = Odometry(bias=0.02, alpha1=0.0004, alpha2=0.0001, alpha3=0.0004, alpha4=0.0001)
    return [
        StudyCase(f"{world}, {name}{much}", named(name), "5-20 s", odometry, f"Door{world}-v0")
        for world in ("Corridor", "Loop", "Office", "Crowd", "Wings")
        for much, odometry in (("", ()), (", good odometry", (("odometry", good),)))
        for name in ("static-ml", "dynamic-ml", "dynamic-graph", "dynamic-pf")
    ]


STUDIES: dict[str, Callable[[], list[StudyCase]]] = {
    "models": models,
    "accuracy": accuracy,
    "readings": readings,
    "rates": rates,
    "windows": windows,
    "loops": loops,
    "long": long,
    "covariance": covariance,
}
