"""GoalAgent: drives to where a `GoalChooser` says, on the SLAM's map."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.goal import NOTHING, Goal
from dynslam_env.navigation.pilot import REPLAN, Pilot
from dynslam_env.navigation.site import PatrolView
from dynslam_env.navigation.survey import PlanningSnapshot, survey


class GoalChooser(Protocol):
    """One way to choose goals. It is asked about once a second; one object an episode."""

    def goal(self, survey: PlanningSnapshot) -> Goal | None:
        """Where to go now; None to stand still."""
        ...

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """The robot stood at the goal and looked (`reached`), or could not get on, at `time` s."""
        ...


class GoalAgent:
    """Plans on the costmap to the goal that `choice` names, follows the path, and gets unstuck.

    One object an episode; its clock is the site's.

    site    the environment; see `PatrolView`
    choice  where to go
    seed    of the recoveries
    """

    def __init__(
        self, site: PatrolView, choice: GoalChooser, seed: int | np.random.SeedSequence = 0
    ):
        self._site, self._choice = site, choice
        self._pilot = Pilot(site, np.random.default_rng(seed))
        self._next = -math.inf  # s, when to choose again

    @property
    def goal(self) -> Goal | None:
        """Where it is going."""
        return self._pilot.goal

    def predict(
        self,
        observation: Any = None,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """The next action (2,), in -1 .. 1; `state` is handed through."""
        return self._action(), state

    def _action(self) -> NDArray[np.float32]:
        pilot = self._pilot
        if not pilot.recovering:
            if pilot.arrived:
                self._end(reached=True)
            if self._site.time >= self._next:
                self._choose()
        action = pilot.action()
        if pilot.stuck:
            self._end(reached=False)
        return action

    def _end(self, reached: bool) -> None:
        if self._pilot.goal is not None:
            self._choice.ended(self._pilot.goal, reached, self._site.time)
        self._next = -math.inf
        self._pilot.halt()

    def _choose(self) -> None:
        seen = survey(self._site)
        self._next = self._site.time + REPLAN
        goal = self._kept(seen) or self._choice.goal(seen) or _leave(seen)
        if goal is None:
            self._pilot.halt()
        else:
            self._pilot.go(goal, seen)

    def _kept(self, seen: PlanningSnapshot) -> Goal | None:
        """The present goal, where a leaf may sweep: that is no place to think again."""
        return self._pilot.goal_in(seen) if _in_the_way(seen) else None


def _in_the_way(survey: PlanningSnapshot) -> bool:
    """Whether the robot is where a leaf may sweep."""
    here = survey.costmap.spec.cells(np.array([survey.position]))[0]
    return bool(survey.costmap.swept[tuple(here)])


def _leave(survey: PlanningSnapshot) -> Goal | None:
    """Out of where a leaf may sweep, if the robot is there: that is no place to stand still."""
    if not _in_the_way(survey):
        return None
    cost = np.where(survey.costmap.swept, math.inf, survey.plan.cost)
    row, col = np.unravel_index(int(np.argmin(cost)), cost.shape)
    if not math.isfinite(cost[row, col]):
        return None
    return Goal((int(row), int(col)), None, NOTHING)


def look_around(survey: PlanningSnapshot) -> Goal | None:
    """Turn by a quarter, in the widest place that can be reached: there it is seen soonest when a
    door opens, and no leaf comes."""
    fit = survey.plan.reached & ~survey.costmap.swept
    if not fit.any():
        return None
    room = np.where(fit, survey.costmap.clearance, -math.inf)
    row, col = np.unravel_index(int(np.argmax(room)), room.shape)
    heading = math.remainder(survey.pose.theta + math.pi / 2, math.tau)
    return Goal((int(row), int(col)), heading, NOTHING)
