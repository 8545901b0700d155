"""Planning snapshot: the maps and paths from which a goal is chosen, all of one moment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.costmap import Costmap, Inflation, costmap
from dynslam_env.navigation.door_belief import DoorBelief
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from dynslam_env.navigation.planner import Plan, plan
from slam.geometry import Array, Pose2


class PlanningSnapshot(NamedTuple):
    """Estimated pose, maps, and the cheapest paths from the pose to all cells.

    time        s since the episode began
    covariance  (3, 3) of the pose: x, y in m, theta in rad
    read_doors  returns what is believed of each suspected doorway
    """

    time: float
    pose: Pose2
    covariance: Array
    beliefs: Beliefs
    costmap: Costmap
    plan: Plan
    read_doors: Callable[[], Sequence[DoorBelief]] = tuple

    @property
    def position(self) -> tuple[float, float]:
        """x, y of the robot, m."""
        return self.pose.x, self.pose.y

    def centre(self, cell: tuple[int, int]) -> tuple[float, float]:
        """x, y in m of the centre of a cell of the costmap."""
        spec, (row, col) = self.costmap.spec, cell
        return (col + spec.col0 + 0.5) * spec.resolution, (row + spec.row0 + 0.5) * spec.resolution


def planning_snapshot(
    snapshot: PatrolSnapshot, inflation: Inflation = Inflation()
) -> PlanningSnapshot:
    """Compute the costmap of a snapshot's maps, and plan to every cell of it."""
    pose, beliefs, radius = snapshot.pose, snapshot.beliefs, snapshot.robot.radius
    costs = costmap(snapshot.map, beliefs, snapshot.scan, pose, radius, inflation)
    return PlanningSnapshot(
        snapshot.time,
        pose,
        snapshot.covariance,
        beliefs,
        costs,
        plan(costs, pose),
        snapshot.read_doors,
    )
