"""Pilot: drives to a goal on the SLAM's map, or along a path, and gets unstuck."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.follower import Follower
from dynslam_env.navigation.goal import Goal
from dynslam_env.navigation.pursuit import Command
from dynslam_env.navigation.recovery import Recovery
from dynslam_env.navigation.site import PatrolView
from dynslam_env.navigation.survey import PlanningSnapshot

REPLAN = 1.0  # s, between two looks at the map


class Pilot:
    """A follower, and the recoveries from where it does not get on.

    site      the environment
    rng       of the recoveries
    follower  which is given its paths, here or by whoever knows one
    goal      where it drives to; None where it stands, or follows a path that it was given
    stuck     whether the last action began a recovery: it does not get there
    """

    def __init__(self, site: PatrolView, rng: np.random.Generator):
        self.follower = Follower(site)
        self.goal: Goal | None = None
        self.stuck = False
        self._site, self._recovery = site, Recovery(rng)
        self._at = np.zeros(2)  # m, where the goal is: a map that grows numbers its cells anew

    def go(self, goal: Goal, survey: PlanningSnapshot) -> None:
        """Drive from now on to a goal that can be reached, by the map of `survey`."""
        path = survey.plan.path(goal.cell)
        clearance = survey.costmap.clearance[tuple(survey.costmap.spec.cells(path).T)]
        self.goal, self._at = goal, survey.centre(goal.cell)
        self.follower.follow(path, goal.heading, clearance)

    def halt(self) -> None:
        """Stand still from now on."""
        self.goal = None
        self.follower.halt()

    def goal_in(self, survey: PlanningSnapshot) -> Goal | None:
        """The present goal on a later map; None where there is none, or no way leads there now."""
        if self.goal is None:
            return None
        row, col = survey.costmap.spec.cells(self._at[None])[0].tolist()
        return self.goal._replace(cell=(row, col)) if survey.plan.reached[row, col] else None

    def replan(self, survey: PlanningSnapshot) -> None:
        """Drive on to the same goal by a later map; stand still where no way leads there now."""
        goal = self.goal_in(survey)
        if goal is None:
            self.halt()
        else:
            self.go(goal, survey)

    @property
    def arrived(self) -> bool:
        """At the end of its way, looking where it was to look."""
        return self.follower.arrived

    @property
    def recovering(self) -> bool:
        """Whether it is about to get unstuck, whatever it was told."""
        return self._recovery.command(self._site.time) is not None

    def action(self) -> NDArray[np.float32]:
        """The next action (2,), in -1 .. 1."""
        return action(self._command(), self._site)

    def _command(self) -> Command:
        now, self.stuck = self._site.time, False
        recovering = self._recovery.command(now)
        if recovering is not None:
            return recovering
        command = self.follower.command()
        self.stuck = self._recovery.stuck(now, self._site.slam.pose, self.follower.state)
        return self._recovery.begin(now) if self.stuck else command


def action(command: Command, site: PatrolView) -> NDArray[np.float32]:
    """A command in m/s and rad/s as an action (2,) in -1 .. 1."""
    return np.clip(np.divide(command, site.limits), -1.0, 1.0).astype(np.float32)
