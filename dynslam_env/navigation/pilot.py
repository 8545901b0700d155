"""Pilot: drives to a goal on the SLAM's map, or along a path, and recovers when stuck."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.follower import Follower
from dynslam_env.navigation.goal import Goal
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from dynslam_env.navigation.pursuit import Command
from dynslam_env.navigation.recovery import Recovery

REPLAN_PERIOD = 1.0  # s, between two plans


class Pilot:
    """A path follower with recoveries.

    rng       of the recoveries
    follower  to which paths are given by `go`, or directly
    goal      the present goal; None while standing, or on a path given directly
    stuck     whether the last action began a recovery: the goal was not reached
    """

    def __init__(self, rng: np.random.Generator):
        self.follower = Follower()
        self.goal: Goal | None = None
        self.stuck = False
        self._recovery = Recovery(rng)
        self._goal_point = np.zeros(2)  # m: cell numbers change when the map grows

    def go(self, goal: Goal, planning: PlanningSnapshot) -> None:
        """Drive to a goal that `planning` can reach."""
        path = planning.plan.path(goal.cell)
        clearance = planning.costmap.clearance[tuple(planning.costmap.spec.cells(path).T)]
        self.goal, self._goal_point = goal, np.array(planning.centre(goal.cell))
        self.follower.follow(path, goal.heading, clearance)

    def halt(self) -> None:
        """Drop the goal and stand still."""
        self.goal = None
        self.follower.halt()

    def goal_in(self, planning: PlanningSnapshot) -> Goal | None:
        """The present goal in a later map; None without a goal, or where no path leads to it."""
        if self.goal is None:
            return None
        row, col = planning.costmap.spec.cells(self._goal_point[None])[0].tolist()
        return self.goal._replace(cell=(row, col)) if planning.plan.reached[row, col] else None

    def replan(self, planning: PlanningSnapshot) -> None:
        """Drive to the same goal by a later map; halt where no path leads to it."""
        goal = self.goal_in(planning)
        if goal is None:
            self.halt()
        else:
            self.go(goal, planning)

    def arrived(self, snapshot: PatrolSnapshot) -> bool:
        """Whether the robot is at the end of its path and has the heading."""
        return self.follower.arrived(snapshot.pose)

    def recovering(self, snapshot: PatrolSnapshot) -> bool:
        """Whether a recovery is under way, which takes precedence over the path."""
        return self._recovery.command(snapshot.time) is not None

    def action(self, snapshot: PatrolSnapshot) -> NDArray[np.float32]:
        """The next action (2,), in -1 .. 1."""
        return action(self._command(snapshot), snapshot.limits)

    def _command(self, snapshot: PatrolSnapshot) -> Command:
        now, self.stuck = snapshot.time, False
        recovery = self._recovery.command(now)
        if recovery is not None:
            return recovery
        command = self.follower.command(snapshot)
        self.stuck = self._recovery.stuck(now, snapshot.pose, self.follower.state)
        return self._recovery.begin(now) if self.stuck else command


def action(command: Command, limits: tuple[float, float]) -> NDArray[np.float32]:
    """A command in m/s and rad/s as an action (2,) in -1 .. 1; `limits` stand for 1."""
    return np.clip(np.divide(command, limits), -1.0, 1.0).astype(np.float32)
