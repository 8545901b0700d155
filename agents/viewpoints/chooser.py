"""ViewpointChooser: explores a floor, and drives to the viewpoints that a policy chooses."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from agents.goal_choosers.frontiers import FrontierChooser, nearest
from agents.goal_choosers.goal_agent import look_around
from agents.viewpoints.missed import SAME_DOOR, Missed
from agents.viewpoints.situation import DoorRows, Situation, ViewpointPolicy
from agents.viewpoints.table import (
    DRIVING_SPEED,
    LOOK_TIME,
    OVERHEAD,
    ViewpointTable,
    viewpoint_table,
    ways_from,
)
from dynslam_env.navigation.blacklist import Blacklist
from dynslam_env.navigation.door_belief import DoorBelief
from dynslam_env.navigation.goal import NO_TARGET, Goal
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from slam.geometry import Array

EXPLORE_TIME = 150.0  # s, for which planners explore first, if frontiers remain
EXPLORE_SLICE = 10.0  # s, for which a policy that chose to explore does so at most
TURN_ANGLE = math.radians(170)  # of the look around; with the laser's half circle, all is seen
TABLE_AGE = 40.0  # s, after which the table is made anew: the map has grown
BESIDE = 1.0  # m, from a viewpoint, at which the robot counts as being there
REST_TIME = 30.0  # s for which a viewpoint that could not be reached is left out

Beliefs = Callable[[], Sequence[DoorBelief]]


class ViewpointChooser:
    """Nearest frontiers first; then the viewpoints of a policy, with a look around at each, or more
    frontiers where the policy chooses to explore.

    policy   chooses the viewpoints
    beliefs  the doorways as they are believed now, instead of the patrol's beliefs
    explored s, for which it explores before it asks the policy
    """

    def __init__(
        self,
        policy: ViewpointPolicy,
        beliefs: Beliefs | None = None,
        explored: float = EXPLORE_TIME,
    ):
        self._policy, self._beliefs, self._explored = policy, beliefs, explored
        self._explorer, self._until = FrontierChooser(nearest), explored  # s, while it explores
        self._blacklist, self._missed = Blacklist(), Missed()
        self._table: ViewpointTable | None = None
        self._made = -math.inf  # s, when the table was
        self._target: tuple[float, float] | None = None
        self._heading: float | None = None  # of the look around, once it began
        self._arrived, self._since = False, 0.0  # s, when it decided
        self._promised: tuple[Array, Array] | None = None  # the viewpoint, doorways it shows
        self._looked: tuple[Array, Array] | None = None  # the same, once it looked around there

    def goal(self, planning: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        goal = self._exploring(planning) or self._present(planning)
        if goal is None:
            self._decide(planning)
            goal = self._exploring(planning) or self._present(planning)
        return goal or look_around(planning)

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`."""
        if self._until > -math.inf:
            self._explorer.ended(goal, reached, time)
            self._until = self._explored
            return
        if not reached and self._target is not None:
            self._blacklist.add(self._target, time, REST_TIME)
        if reached and not self._arrived:
            self._arrived = True
            return
        if not reached:
            self._promised = None
        self._looked, self._target = self._promised, None

    def _exploring(self, planning: PlanningSnapshot) -> Goal | None:
        """The frontier to drive to, while the robot explores."""
        goal = self._frontier(planning) if planning.time < self._until else None
        if goal is None:
            self._until = -math.inf
        return goal

    def _frontier(self, planning: PlanningSnapshot) -> Goal | None:
        goal = self._explorer.goal(planning)
        return None if goal is None or goal.target == NO_TARGET else goal

    def _present(self, planning: PlanningSnapshot) -> Goal | None:
        """The present viewpoint, if a path leads there; once there, with the look around."""
        if self._target is None:
            return None
        row, col = planning.costmap.spec.cells(np.array([self._target]))[0].tolist()
        if not planning.plan.reached[row, col]:
            return None
        if self._arrived and self._heading is None:
            self._heading = math.remainder(planning.pose.theta + TURN_ANGLE, math.tau)
        return Goal((row, col), self._heading, self._target)

    def _decide(self, planning: PlanningSnapshot) -> None:
        beliefs = self._beliefs() if self._beliefs else planning.read_doors()
        if self._looked is not None:
            self._missed.compare(*self._looked, beliefs, planning.time, self._since)
        self._target, self._heading, self._arrived, self._looked = None, None, False, None
        self._since, self._promised = planning.time, None
        self._until = planning.time + EXPLORE_SLICE
        if not beliefs:
            return
        table = self._current(planning, beliefs)
        situation = self._situation(planning, table, beliefs)
        if not np.isfinite(situation.times).any():
            return
        chosen = self._policy.choose(situation)
        if chosen < len(table.points):
            self._until = -math.inf
            x, y = table.points[chosen].tolist()
            shown = table.doors[table.around[chosen]]
            self._target, self._promised = (x, y), (table.points[chosen], shown)

    def _frontier_time(self, planning: PlanningSnapshot) -> float:
        """s, to drive to the frontier and look there; inf without one."""
        goal = self._frontier(planning)
        length = math.inf if goal is None else float(planning.plan.length[goal.cell])
        return length / DRIVING_SPEED + OVERHEAD + LOOK_TIME

    def _current(self, planning: PlanningSnapshot, beliefs: Sequence[DoorBelief]) -> ViewpointTable:
        """The table for these doorways, made anew if they are others or the map is older."""
        table, places = self._table, np.array([one.place for one in beliefs])
        old = table is None or planning.time > self._made + TABLE_AGE
        if table is None or old or not _same(table.doors, places):
            table = viewpoint_table(planning.costmap, planning.plan, places)
            self._table, self._made = table, planning.time
        return table

    def _situation(
        self, planning: PlanningSnapshot, table: ViewpointTable, beliefs: Sequence[DoorBelief]
    ) -> Situation:
        ways = ways_from(planning.costmap, planning.plan, table.points, table.doors, table.around)
        resting = [self._blacklist.holds((x, y), planning.time) for x, y in table.points.tolist()]
        times = np.where(np.array(resting, dtype=np.bool_), np.inf, ways.times)
        shown = ~self._missed.among(table, planning.time)
        return Situation(
            times, ways.sees & shown, table.between, table.then & shown, DoorRows.of(beliefs),
            _beside(planning, table), planning.time, self._frontier_time(planning),
        )  # fmt: skip


def _same(doors: Array, places: Array) -> bool:
    """Whether doorways (d, 4) are those at `places` (e, 4), in this order."""
    if len(doors) != len(places):
        return False
    return bool((np.hypot(*(doors - places).T[:2]) < SAME_DOOR).all())


def _beside(planning: PlanningSnapshot, table: ViewpointTable) -> int:
    """The viewpoint where the robot is; -1 at none."""
    away = np.hypot(*(table.points - planning.position).T)
    return int(away.argmin()) if away.min(initial=math.inf) < BESIDE else -1
