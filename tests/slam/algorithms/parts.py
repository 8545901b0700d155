"""All parts that can be swapped, by name: a new one is a line here, and every test takes it in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from slam.adaptive_odometry import AdaptiveOdometry
from slam.algorithms.variants import MAPS
from slam.learned_odometry import LearnedOdometry
from slam.motion import OdometryMotion
from slam.perception.beam import Beam
from slam.perception.endpoint import Endpoint
from slam.perception.literal import Literal
from slam.search.correlative import Correlative
from slam.search.gauss_newton import GaussNewton
from slam.search.hill_climb import HillClimb
from slam.search.random_restart import RandomRestart

GRIDS: dict[str, Callable[[], Any]] = dict(MAPS)
READINGS: dict[str, Callable[[], Any]] = {"endpoint": Endpoint, "beam": Beam, "literal": Literal}
MOTIONS: dict[str, Callable[[], Any]] = {
    "odometry": OdometryMotion,
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
