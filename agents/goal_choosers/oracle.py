"""OracleChooser: knows the doors and how they stand, and looks where the belief is most wrong."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from agents.goal_choosers.doors import time_to
from agents.goal_choosers.frontiers import FrontierChooser, nearest
from dynslam_env.env import DoorWorldEnv
from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.blacklist import FORGET, Blacklist
from dynslam_env.navigation.goal import Goal, look_at
from dynslam_env.navigation.survey import PlanningSnapshot
from dynslam_env.worlds.layout import Door, Layout
from slam.geometry import Array

LEAST = 0.05  # error of P(closed): less is not worth a way
KEEP = 1.25  # times: so much better another door must be than the one it is driving to
CLOSED = 0.2  # rad: a door that is open no wider counts as closed
LOOKED = 3.0  # s for which a door just looked at is left alone: its leaf may be on its way
ALONG = np.linspace(0.15, 0.85, 8)  # shares of a closed leaf's width at which the map is asked
ACROSS = (-1.0, 0.0, 1.0)  # cells beside it: a pose that is a little off is no mistake
UNKNOWN = 0.5  # P(occupied) where nothing was seen


class TruthView(Protocol):
    """What the oracle alone is shown."""

    @property
    def layout(self) -> Layout:
        """The place, its doors among it."""
        ...

    @property
    def door_angles(self) -> Array:
        """(d,) rad, as the doors stand now; 0 closed, positive open."""
        ...


class TrueDoors:
    """The truth of a simulated world."""

    def __init__(self, place: DoorWorldEnv):
        self._place = place

    @property
    def layout(self) -> Layout:
        """See `TruthView`."""
        return self._place.layout

    @property
    def door_angles(self) -> Array:
        """See `TruthView`."""
        return self._place.physics.openings.copy()


class OracleChooser:
    """The door of which the belief is most wrong, for each second that it takes to get there.

    How wrong: |P(closed) - closed|, P(closed) as the map has it along the closed leaf. It plans on
    the SLAM's map as the others do; towards a door that no known way leads to, it explores.

    truth  the world as it is
    """

    def __init__(self, truth: TruthView):
        self._truth = truth
        self._explore, self._blacklist = FrontierChooser(nearest), Blacklist()
        self._last: tuple[float, float] | None = None

    def goal(self, survey: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        best, most = None, 0.0
        for door, angle in zip(self._truth.layout.doors, self._truth.door_angles, strict=True):
            wrong = abs(believed_closed(survey.beliefs, door) - (angle < CLOSED))
            middle = _closed_leaf(door, np.array([0.5]))[0]
            goal = look_at(survey, middle) if wrong > LEAST else None
            if goal is None or self._blacklist.holds(goal.target, survey.time):
                continue
            value = wrong / time_to(goal, survey) * (KEEP if goal.target == self._last else 1.0)
            if value > most:
                best, most = goal, value
        if best is None:
            self._last = None
            return self._explore.goal(survey)
        self._last = best.target
        return best

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`."""
        if self._last is None:
            self._explore.ended(goal, reached, time)
        else:
            self._blacklist.add(goal.target, time, LOOKED if reached else FORGET)
        self._last = None


def believed_closed(beliefs: Beliefs, door: Door) -> float:
    """P(closed): along the closed leaf, the mean of what is most occupied near it."""
    along = np.array([math.cos(door.closed), math.sin(door.closed)])
    aside = np.array([-along[1], along[0]]) * beliefs.spec.resolution
    points = _closed_leaf(door, ALONG)
    cells = np.concatenate([beliefs.spec.cells(points + k * aside) for k in ACROSS])
    inside = ((cells >= 0) & (cells < beliefs.spec.shape)).all(axis=1)
    rows, cols = cells[inside].T
    h = np.full(len(cells), np.nan)
    h[inside] = np.where(beliefs.observed[rows, cols], beliefs.occupied[rows, cols], np.nan)
    most = np.fmax.reduce(h.reshape(len(ACROSS), -1))
    return float(np.where(np.isnan(most), UNKNOWN, most).mean())


def _closed_leaf(door: Door, shares: Array) -> Array:
    """(n, 2) m, the points at shares (n,) of its width along the closed leaf."""
    direction = np.array([math.cos(door.closed), math.sin(door.closed)])
    return np.array(door.hinge) + (shares * door.width)[:, None] * direction
