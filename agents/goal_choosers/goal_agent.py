"""GoalAgent: drives to the goals of a `GoalChooser` on the SLAM's map."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.goal import NO_TARGET, Goal
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot, PatrolView
from dynslam_env.navigation.pilot import REPLAN_PERIOD, Pilot
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot, planning_snapshot


class GoalChooser(Protocol):
    """A way to choose goals, called about once a second; one object per episode."""

    def goal(self, planning: PlanningSnapshot) -> Goal | None:
        """The next goal; None to stand still."""
        ...

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """The robot reached the goal and its heading, or was stuck before, at `time` s."""
        ...


class GoalAgent:
    """Plans to the goal of `chooser` on the costmap, follows the path, and recovers.

    One object per episode. Each decision takes one snapshot of the patrol; once a second it chooses
    the goal and plans again.

    view     the environment
    chooser  of the goals
    seed     of the recoveries
    replan   s, from one plan to the next
    """

    def __init__(
        self,
        view: PatrolView,
        chooser: GoalChooser,
        seed: int | np.random.SeedSequence = 0,
        replan: float = REPLAN_PERIOD,
    ):
        self._view, self._chooser, self._replan = view, chooser, replan
        self._pilot = Pilot(np.random.default_rng(seed))
        self._next = -math.inf  # s, when to choose again

    @property
    def goal(self) -> Goal | None:
        """The present goal."""
        return self._pilot.goal

    def predict(
        self,
        observation: Any = None,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """The next action (2,), in -1 .. 1; `state` is returned unchanged."""
        return self._action(self._view.snapshot()), state

    def _action(self, snapshot: PatrolSnapshot) -> NDArray[np.float32]:
        pilot = self._pilot
        if not pilot.recovering(snapshot):
            if pilot.arrived(snapshot):
                self._end(snapshot.time, reached=True)
            if snapshot.time >= self._next:
                self._choose(snapshot)
        action = pilot.action(snapshot)
        if pilot.stuck:
            self._end(snapshot.time, reached=False)
        return action

    def _end(self, time: float, reached: bool) -> None:
        if self._pilot.goal is not None:
            self._chooser.ended(self._pilot.goal, reached, time)
        self._next = -math.inf
        self._pilot.halt()

    def _choose(self, snapshot: PatrolSnapshot) -> None:
        planning = planning_snapshot(snapshot)
        self._next = snapshot.time + self._replan
        goal = self._kept(planning) or self._chooser.goal(planning) or _leave(planning)
        if goal is None:
            self._pilot.halt()
        else:
            self._pilot.go(goal, planning)

    def _kept(self, planning: PlanningSnapshot) -> Goal | None:
        """The present goal while the robot is in the swing of a leaf: it first leaves that area."""
        return self._pilot.goal_in(planning) if _is_swept(planning) else None


def _is_swept(planning: PlanningSnapshot) -> bool:
    """Whether the robot is where a leaf may sweep."""
    cell = planning.costmap.spec.cells(np.array([planning.position]))[0]
    return bool(planning.costmap.swept[tuple(cell)])


def _leave(planning: PlanningSnapshot) -> Goal | None:
    """The nearest cell by path cost that no leaf may sweep, if the robot stands in one."""
    if not _is_swept(planning):
        return None
    cost = np.where(planning.costmap.swept, math.inf, planning.plan.cost)
    row, col = np.unravel_index(int(np.argmin(cost)), cost.shape)
    if not math.isfinite(cost[row, col]):
        return None
    return Goal((int(row), int(col)), None, NO_TARGET)


def look_around(planning: PlanningSnapshot) -> Goal | None:
    """Turn by a quarter at the reachable cell of the largest clearance: an opening door is seen
    from there, and no leaf sweeps it."""
    fit = planning.plan.reached & ~planning.costmap.swept
    if not fit.any():
        return None
    clearance = np.where(fit, planning.costmap.clearance, -math.inf)
    row, col = np.unravel_index(int(np.argmax(clearance)), clearance.shape)
    heading = math.remainder(planning.pose.theta + math.pi / 2, math.tau)
    return Goal((int(row), int(col)), heading, NO_TARGET)
