"""Lookout: turns on the spot at the place with the widest view."""

from __future__ import annotations

import math

import numpy as np

from agents.goal_choosers.goal_agent import look_around
from dynslam_env.navigation.goal import NO_TARGET, Goal
from dynslam_env.navigation.information import seen_around
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot

TURN_AHEAD = 2.5  # rad, of the heading: farther than the robot turns before the next choice
MIN_CLEARANCE = 0.3  # m, of a place
VIEW_RATIO = 1.1  # factor by which the view of another place must be wider
PLACES = 60  # number of places compared
MOVE_PERIOD = 5.0  # s, of turning between two comparisons


class LookoutChooser:
    """Turns on the spot where most of the observed cells are in sight, within the laser's range.

    Not from a paper: if most doors are seen from one place, driving on turns the laser away from
    half of them.

    rng        draws the places
    max_range  m, of the laser
    """

    def __init__(self, rng: np.random.Generator, max_range: float):
        self._rng, self._max_range = rng, max_range
        self._place: tuple[float, float] | None = None
        self._next = -math.inf  # s, when to compare places again

    def goal(self, planning: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        costmap = planning.costmap
        fit = planning.plan.reached & ~costmap.swept & (costmap.clearance > MIN_CLEARANCE)
        if not fit.any():
            return look_around(planning)
        cells, spec = np.argwhere(fit), costmap.spec
        if self._place is None or planning.time >= self._next:
            drawn = spec.centres(cells[self._rng.integers(len(cells), size=PLACES)])
            drawn[0] = planning.position if self._place is None else self._place
            seen = seen_around(planning.beliefs, drawn, self._max_range)
            seen[0] *= VIEW_RATIO
            x, y = drawn[int(np.argmax(seen))].tolist()
            self._place, self._next = (x, y), planning.time + MOVE_PERIOD
        distance = np.hypot(*(spec.centres(cells) - self._place).T)
        row, col = cells[int(np.argmin(distance))].tolist()
        heading = math.remainder(planning.pose.theta + TURN_AHEAD, math.tau)
        return Goal((row, col), heading, NO_TARGET)

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`."""
