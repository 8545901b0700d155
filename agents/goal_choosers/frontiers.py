"""Frontier exploration: the nearest frontier, or the one of explore_lite's least cost."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from agents.goal_choosers.goal_agent import look_around
from dynslam_env.navigation.blacklist import Blacklist
from dynslam_env.navigation.frontiers import Frontier, frontiers
from dynslam_env.navigation.goal import Goal, explore
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from slam.validation import positive, within

SAME_FRONTIER_DISTANCE = 1.5  # m, by which a frontier may move while it is approached
SWITCH_COST = 1.5  # factor by which another frontier must be cheaper than the goal

Cost = Callable[[Frontier], float]


def nearest(frontier: Frontier) -> float:
    """Length of the path to the frontier, m (Yamauchi 1997)."""
    return frontier.length


@dataclass(frozen=True)
class ExploreLite:
    """The cost of explore_lite (Horner 2016), a ROS package, with the defaults of its code.

    potential_scale * distance - gain_scale * size, both in m: the size as the length of a frontier.
    The least cost is chosen. With these defaults the size decides; the distance, which explore_lite
    takes as a straight line, breaks ties.

    potential_scale  1/m
    gain_scale       1/m
    resolution       m, of a frontier's cells
    """

    potential_scale: float = 1e-3
    gain_scale: float = 1.0
    resolution: float = 0.1

    def __post_init__(self) -> None:
        within(self, "potential_scale", 0.0)
        within(self, "gain_scale", 0.0)
        positive(self, "resolution")

    def __call__(self, frontier: Frontier) -> float:
        """The cost."""
        size = frontier.size * self.resolution
        return self.potential_scale * frontier.distance - self.gain_scale * size


class FrontierChooser:
    """Chooses the frontier of least `cost`; without any frontier, the robot stands still.

    If frontiers remain but no path leads to them, as behind a closed door, it turns on the spot and
    waits.

    cost       of a frontier
    min_cells  of a frontier; explore_lite's is 0.5 m
    """

    def __init__(self, cost: Cost, min_cells: int = 5):
        self._cost, self._min_cells = cost, min_cells
        self._blacklist = Blacklist()
        self._last: tuple[float, float] | None = None

    def goal(self, planning: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        found = frontiers(planning.costmap, planning.plan, planning.position, self._min_cells)
        best, least = None, math.inf
        for frontier in found:
            goal = explore(planning, frontier)
            if goal is None or self._blacklist.holds(goal.target, planning.time):
                continue
            cost = self._cost(frontier) - (SWITCH_COST if self._is_last(goal.target) else 0.0)
            if cost < least:
                best, least = goal, cost
        if best is None:
            return look_around(planning) if found else None
        self._last = best.target
        return best

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`: a frontier that remains after a visit cannot be explored."""
        self._blacklist.add(goal.target, time)
        self._last = None

    def _is_last(self, target: tuple[float, float]) -> bool:
        return self._last is not None and math.dist(target, self._last) < SAME_FRONTIER_DISTANCE
