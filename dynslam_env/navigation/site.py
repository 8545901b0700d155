"""Site: what an agent that navigates is given. The truth is not in it."""

from __future__ import annotations

from typing import Protocol

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.simulation.robot import Robot
from slam.geometry import Array
from slam.interface import Slam
from slam.scan import Scan


class PatrolView(Protocol):
    """A patrol environment as a classical agent sees it."""

    @property
    def slam(self) -> Slam:
        """Its `map()` and its `pose` are estimates."""
        ...

    @property
    def covariance(self) -> Array:
        """(3, 3) of the SLAM's pose, as it believes: x, y in m, theta in rad."""
        ...

    @property
    def time(self) -> float:
        """s since the episode began."""
        ...

    @property
    def robot(self) -> Robot:
        """Body and limits."""
        ...

    @property
    def limits(self) -> tuple[float, float]:
        """m/s and rad/s that an action of 1 stands for."""
        ...

    @property
    def period(self) -> float:
        """s that an action is held."""
        ...

    @property
    def scan(self) -> Scan:
        """The last scan: no echo is inf, no reading NaN."""
        ...

    def beliefs(self) -> Beliefs:
        """The task's dynamic map, predicted for now."""
        ...
