"""Which frontier to explore: the nearest, or the one of explore_lite's least cost."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from agents.goal_choosers.goal_agent import look_around
from dynslam_env.navigation.blacklist import Blacklist
from dynslam_env.navigation.frontiers import Frontier, frontiers
from dynslam_env.navigation.goal import Goal, explore
from dynslam_env.navigation.survey import PlanningSnapshot
from slam.validation import positive, within

SHIFT = 1.5  # m, by which the centroid of a frontier may move as it is driven to
STAY = 1.5  # m or cost by which another frontier must be better than the one it is driving to

Cost = Callable[[Frontier], float]


def nearest(frontier: Frontier) -> float:
    """m of the way to it (Yamauchi 1997)."""
    return frontier.length


@dataclass(frozen=True)
class ExploreLite:
    """The cost of explore_lite (Horner 2016), a ROS package, with the defaults of its code.

    potential_scale * distance - gain_scale * size, both in m: the size as the length of a frontier.
    The least cost is gone for. With these defaults it is the size that decides; the distance, which
    there is taken straight, breaks ties.

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
    """The frontier of least `cost`; where there is none, the robot stands still until there is.

    While frontiers are left but no way leads to any, as behind a door that closed, it turns on the
    spot and waits.

    cost      of a frontier
    smallest  cells, of a frontier; explore_lite's is 0.5 m
    """

    def __init__(self, cost: Cost, smallest: int = 5):
        self._cost, self._smallest = cost, smallest
        self._blacklist = Blacklist()
        self._last: tuple[float, float] | None = None

    def goal(self, survey: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        found = frontiers(survey.costmap, survey.plan, survey.position, self._smallest)
        best, least = None, math.inf
        for frontier in found:
            goal = explore(survey, frontier)
            if goal is None or self._blacklist.holds(goal.target, survey.time):
                continue
            cost = self._cost(frontier) - (STAY if self._is_last(goal.target) else 0.0)
            if cost < least:
                best, least = goal, cost
        if best is None:
            return look_around(survey) if found else None
        self._last = best.target
        return best

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`: a frontier that is still one after a visit cannot be explored."""
        self._blacklist.add(goal.target, time)
        self._last = None

    def _is_last(self, target: tuple[float, float]) -> bool:
        return self._last is not None and math.dist(target, self._last) < SHIFT
