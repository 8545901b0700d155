"""OracleChooser: knows the true doors, and visits the one with the largest error of belief."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from agents.goal_choosers.doors import time_to
from agents.goal_choosers.frontiers import FrontierChooser, nearest
from dynslam_env.env import DoorWorldEnv
from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.blacklist import BLACKLIST_TIME, Blacklist
from dynslam_env.navigation.goal import Goal, look_at
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from dynslam_env.patrol.doors_known import CLOSED_ANGLE, LEAF_SHARES, SIDE_CELLS
from dynslam_env.worlds.layout import Door
from slam.geometry import Array

MIN_ERROR = 0.05  # of P(closed), for a door to be visited
SWITCH_RATIO = 1.25  # factor by which another door must be better than the present goal
SWING_TIME = 3.0  # s for which a door just looked at is left out: its leaf may be moving
UNSEEN_CELL = 0.5  # P(occupied) of a cell that was never observed


class DoorTruth(NamedTuple):
    """The true doors at one moment.

    doors   of the layout
    angles  (d,) rad; 0 closed, positive open
    """

    doors: tuple[Door, ...]
    angles: Array


def door_truth(place: DoorWorldEnv) -> DoorTruth:
    """The current doors of a simulated world."""
    return DoorTruth(place.layout.doors, place.physics.openings.copy())


class OracleChooser:
    """Chooses the door with the largest ratio of belief error to travel time.

    The error is |P(closed) - closed|, with P(closed) from the map along the closed leaf. It plans
    on the SLAM's map like the others; if no known path leads to a door, it explores.

    truth  gives the true doors, read once a choice
    """

    def __init__(self, truth: Callable[[], DoorTruth]):
        self._truth = truth
        self._explorer, self._blacklist = FrontierChooser(nearest), Blacklist()
        self._last: tuple[float, float] | None = None

    def goal(self, planning: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        best, most = None, 0.0
        for door, angle in zip(*self._truth(), strict=True):
            error = abs(believed_closed(planning.beliefs, door) - (angle < CLOSED_ANGLE))
            middle = _closed_leaf(door, np.array([0.5]))[0]
            goal = look_at(planning, middle) if error > MIN_ERROR else None
            if goal is None or self._blacklist.holds(goal.target, planning.time):
                continue
            ratio = SWITCH_RATIO if goal.target == self._last else 1.0
            value = error / time_to(goal, planning) * ratio
            if value > most:
                best, most = goal, value
        if best is None:
            self._last = None
            return self._explorer.goal(planning)
        self._last = best.target
        return best

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`."""
        if self._last is None:
            self._explorer.ended(goal, reached, time)
        else:
            self._blacklist.add(goal.target, time, SWING_TIME if reached else BLACKLIST_TIME)
        self._last = None


def believed_closed(beliefs: Beliefs, door: Door) -> float:
    """P(closed): the mean along the closed leaf of the largest P(occupied) across it."""
    along = np.array([math.cos(door.closed), math.sin(door.closed)])
    across = np.array([-along[1], along[0]]) * beliefs.spec.resolution
    points = _closed_leaf(door, LEAF_SHARES)
    cells = np.concatenate([beliefs.spec.cells(points + k * across) for k in SIDE_CELLS])
    inside = ((cells >= 0) & (cells < beliefs.spec.shape)).all(axis=1)
    rows, cols = cells[inside].T
    h = np.full(len(cells), np.nan)
    h[inside] = np.where(beliefs.observed[rows, cols], beliefs.occupied[rows, cols], np.nan)
    most = np.fmax.reduce(h.reshape(len(SIDE_CELLS), -1))
    return float(np.where(np.isnan(most), UNSEEN_CELL, most).mean())


def _closed_leaf(door: Door, shares: Array) -> Array:
    """(n, 2) m, the points at `shares` (n,) of the width along the closed leaf."""
    direction = np.array([math.cos(door.closed), math.sin(door.closed)])
    return np.array(door.hinge) + (shares * door.width)[:, None] * direction
