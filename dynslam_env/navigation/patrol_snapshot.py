"""Patrol snapshot: what a robot on patrol knows at one moment. The truth is not in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.door_belief import DoorBelief
from dynslam_env.simulation.robot import Robot
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.scan import Scan


@dataclass(frozen=True, eq=False)
class PatrolSnapshot:
    """The state of a patrol as the robot perceives it; an agent takes one a decision.

    The two maps are copied at the first access, which must come before the next step of the
    environment: most decisions need no map.

    time          s since the episode began
    pose          estimate of the SLAM
    covariance    (3, 3) of that pose, as the SLAM estimates it: x, y in m, theta in rad
    scan          the last scan: inf for no echo, NaN for no reading
    robot         body and limits
    limits        m/s and rad/s that an action of 1 stands for
    period        s for which an action is held
    read_map      returns the SLAM's map
    read_beliefs  returns the task's dynamic map, predicted for `time`
    read_doors    returns what is believed of each suspected doorway at `time`
    """

    time: float
    pose: Pose2
    covariance: Array
    scan: Scan
    robot: Robot
    limits: tuple[float, float]
    period: float
    read_map: Callable[[], OccupancyGrid] = field(repr=False)
    read_beliefs: Callable[[], Beliefs] = field(repr=False)
    read_doors: Callable[[], list[DoorBelief]] = field(default=list, repr=False)

    @cached_property
    def map(self) -> OccupancyGrid:
        """The SLAM's map."""
        return self.read_map()

    @cached_property
    def beliefs(self) -> Beliefs:
        """The task's dynamic map, predicted for `time`."""
        return self.read_beliefs()


class PatrolView(Protocol):
    """A patrol environment as a classical agent sees it."""

    def snapshot(self) -> PatrolSnapshot:
        """What the robot knows now."""
        ...
