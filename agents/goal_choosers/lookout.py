"""A lookout: the place with the widest view, and turning round there."""

from __future__ import annotations

import math

import numpy as np

from agents.goal_choosers.goal_agent import look_around
from dynslam_env.navigation.goal import NOTHING, Goal
from dynslam_env.navigation.information import seen_around
from dynslam_env.navigation.survey import PlanningSnapshot

AHEAD = 2.5  # rad that it wants to turn on: it is asked again long before it has
ROOM = 0.3  # m to the next wall, where it stands
WIDER = 1.1  # times: so much wider another view must be before it goes there
SAMPLES = 60  # places that are tried
TURN = 5.0  # s, of turning between two thoughts of another place


class LookoutChooser:
    """Turns round on the spot where most of what it knows is in sight, as far as the laser reaches.

    Not out of a paper: in a place where most doors are seen from one spot, to drive on is to turn
    one's back on half of them.

    rng    draws the places
    reach  m, of the laser
    """

    def __init__(self, rng: np.random.Generator, reach: float):
        self._rng, self._reach = rng, reach
        self._place: tuple[float, float] | None = None
        self._again = -math.inf

    def goal(self, survey: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        fit = survey.plan.reached & ~survey.costmap.swept & (survey.costmap.clearance > ROOM)
        if not fit.any():
            return look_around(survey)
        cells, spec = np.argwhere(fit), survey.costmap.spec
        if self._place is None or survey.time >= self._again:
            drawn = spec.centres(cells[self._rng.integers(len(cells), size=SAMPLES)])
            drawn[0] = survey.position if self._place is None else self._place
            wide = seen_around(survey.beliefs, drawn, self._reach)
            wide[0] *= WIDER
            x, y = drawn[int(np.argmax(wide))].tolist()
            self._place, self._again = (x, y), survey.time + TURN
        away = np.hypot(*(spec.centres(cells) - self._place).T)
        row, col = cells[int(np.argmin(away))].tolist()
        return Goal((row, col), math.remainder(survey.pose.theta + AHEAD, math.tau), NOTHING)

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`."""
