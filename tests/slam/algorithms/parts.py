"""All parts that can be swapped, by name: a new one is a line here, and every test takes it in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from slam.algorithms.variants import MAPS
from slam.motion.adaptive import AdaptiveOdometry
from slam.motion.gaussian import GaussianMotion
from slam.motion.learned import LearnedOdometry
from slam.search.correlative import Correlative
from slam.search.gauss_newton import GaussNewton
from slam.search.hill_climb import HillClimb
from slam.search.random_restart import RandomRestart
from slam.sensor_models.beam import Beam
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.literal import Literal

GRIDS: dict[str, Callable[[], Any]] = dict(MAPS)
READINGS: dict[str, Callable[[], Any]] = {"endpoint": Endpoint, "beam": Beam, "literal": Literal}
MOTIONS: dict[str, Callable[[], Any]] = {
    "odometry": GaussianMotion,
    "adaptive": AdaptiveOdometry,
    "learned": LearnedOdometry,
}
SEARCHES: dict[str, Callable[[], Any]] = {
    "hill climb": HillClimb,
    "random restart": RandomRestart,
    "correlative": Correlative,
    "gauss newton": GaussNewton,
}
JUMPING = [name for name in SEARCHES if name != "gauss newton"]
"""What needs no slope: the beam and the literal reading are too rough for one."""
