"""2D laser SLAM that treats change as information. Pure numpy, numba and scipy.

Everything needed to write a custom SLAM variant, map model or file reader is imported from here:
`from slam import Static, maximum_likelihood, register, run, score`. Each name is loaded when it is
first used, so that `import slam` itself is fast.
"""

# ruff: noqa: F401  (for pyright and editors; at run time `__getattr__` imports them)

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from slam.algorithms.dead_reckoning import DeadReckoning
    from slam.algorithms.graph_slam import GraphSlam
    from slam.algorithms.maximum_likelihood import MaximumLikelihood
    from slam.algorithms.particle_filter import ParticleFilter
    from slam.algorithms.variants import graph_slam, maximum_likelihood, particle_filter
    from slam.benchmark.run import Run, build, run, true_start
    from slam.benchmark.score import score
    from slam.episode import Episode, Truth
    from slam.errors import InputError
    from slam.forecast.door import DoorForecast
    from slam.geometry import Pose2
    from slam.grid import GridSpec, OccupancyGrid
    from slam.interface import (
        Builder,
        Estimate,
        MapModel,
        MotionModel,
        Posterior,
        Restarting,
        Revising,
        Search,
        SensorModel,
        Slam,
        Slope,
    )
    from slam.io.episode_file import load_episode, save_episode
    from slam.io.forecast_file import load_forecast, save_forecast
    from slam.io.formats import Reader, read_log, register_reader, write_log
    from slam.io.loaded_recording import LoadedRecording
    from slam.maps.cells import Cells
    from slam.maps.clamped import Clamped
    from slam.maps.filtered import Filtered
    from slam.maps.histogram import Histogram
    from slam.maps.hmm import HMM
    from slam.maps.hybrid import Hybrid
    from slam.maps.log_odds import Evidence
    from slam.maps.mean import Mean
    from slam.maps.rays import Rays
    from slam.maps.recency import Recency
    from slam.maps.static import Static
    from slam.maps.temporal import Temporal
    from slam.motion.adaptive import AdaptiveOdometry
    from slam.motion.gaussian import GaussianMotion, Prediction
    from slam.motion.learned import LearnedOdometry
    from slam.motion.threshold import MotionThreshold
    from slam.registry import make, register, register_map, variants
    from slam.scan import Scan
    from slam.search.correlative import Correlative
    from slam.search.gauss_newton import GaussNewton
    from slam.search.hill_climb import HillClimb
    from slam.search.random_restart import RandomRestart
    from slam.sensor_models.beam import Beam
    from slam.sensor_models.endpoint import Endpoint
    from slam.sensor_models.literal import Literal
    from slam.trajectory import Trajectory

_MODULES = {
    "AdaptiveOdometry": "slam.motion.adaptive",
    "Beam": "slam.sensor_models.beam",
    "Builder": "slam.interface",
    "Cells": "slam.maps.cells",
    "Clamped": "slam.maps.clamped",
    "Correlative": "slam.search.correlative",
    "DeadReckoning": "slam.algorithms.dead_reckoning",
    "DoorForecast": "slam.forecast.door",
    "Endpoint": "slam.sensor_models.endpoint",
    "Episode": "slam.episode",
    "Estimate": "slam.interface",
    "Evidence": "slam.maps.log_odds",
    "Filtered": "slam.maps.filtered",
    "GaussNewton": "slam.search.gauss_newton",
    "GaussianMotion": "slam.motion.gaussian",
    "GraphSlam": "slam.algorithms.graph_slam",
    "GridSpec": "slam.grid",
    "HMM": "slam.maps.hmm",
    "HillClimb": "slam.search.hill_climb",
    "Histogram": "slam.maps.histogram",
    "Hybrid": "slam.maps.hybrid",
    "InputError": "slam.errors",
    "LearnedOdometry": "slam.motion.learned",
    "Literal": "slam.sensor_models.literal",
    "LoadedRecording": "slam.io.loaded_recording",
    "MapModel": "slam.interface",
    "MaximumLikelihood": "slam.algorithms.maximum_likelihood",
    "Mean": "slam.maps.mean",
    "MotionModel": "slam.interface",
    "MotionThreshold": "slam.motion.threshold",
    "OccupancyGrid": "slam.grid",
    "ParticleFilter": "slam.algorithms.particle_filter",
    "Pose2": "slam.geometry",
    "Posterior": "slam.interface",
    "Prediction": "slam.motion.gaussian",
    "RandomRestart": "slam.search.random_restart",
    "Rays": "slam.maps.rays",
    "Reader": "slam.io.formats",
    "Recency": "slam.maps.recency",
    "Restarting": "slam.interface",
    "Revising": "slam.interface",
    "Run": "slam.benchmark.run",
    "Scan": "slam.scan",
    "Search": "slam.interface",
    "SensorModel": "slam.interface",
    "Slam": "slam.interface",
    "Slope": "slam.interface",
    "Static": "slam.maps.static",
    "Temporal": "slam.maps.temporal",
    "Trajectory": "slam.trajectory",
    "Truth": "slam.episode",
    "build": "slam.benchmark.run",
    "graph_slam": "slam.algorithms.variants",
    "load_episode": "slam.io.episode_file",
    "load_forecast": "slam.io.forecast_file",
    "make": "slam.registry",
    "maximum_likelihood": "slam.algorithms.variants",
    "particle_filter": "slam.algorithms.variants",
    "read_log": "slam.io.formats",
    "register": "slam.registry",
    "register_map": "slam.registry",
    "register_reader": "slam.io.formats",
    "run": "slam.benchmark.run",
    "save_episode": "slam.io.episode_file",
    "save_forecast": "slam.io.forecast_file",
    "score": "slam.benchmark.score",
    "true_start": "slam.benchmark.run",
    "variants": "slam.registry",
    "write_log": "slam.io.formats",
}
__all__ = list(_MODULES)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import a public name from its module (PEP 562)."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *_MODULES]
