"""Survey: all that a choice of where to go is made from, taken at one moment."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.costmap import Costmap, Inflation, costmap
from dynslam_env.navigation.planner import Plan, plan
from dynslam_env.navigation.site import PatrolView
from slam.geometry import Array, Pose2


class PlanningSnapshot(NamedTuple):
    """The estimated pose, the maps, and the ways from there.

    time  s since the episode began
    """

    time: float
    pose: Pose2
    beliefs: Beliefs
    costmap: Costmap
    plan: Plan

    @property
    def position(self) -> tuple[float, float]:
        """x, y of the robot, m."""
        return self.pose.x, self.pose.y

    def centre(self, cell: tuple[int, int]) -> Array:
        """(2,) m, of a cell of the costmap."""
        return self.costmap.spec.centres(np.array([cell]))[0]


def survey(site: PatrolView, inflation: Inflation = Inflation()) -> PlanningSnapshot:
    """Look at the maps, and plan to everywhere."""
    pose, beliefs = Pose2.of(site.slam.pose), site.beliefs()
    grid, scan = site.slam.map(), site.scan
    costs = costmap(grid, beliefs, scan, pose, site.robot.radius, inflation)
    return PlanningSnapshot(site.time, pose, beliefs, costs, plan(costs, pose))
