"""Goal options: the goals that an agent may choose among, and their features."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.blacklist import BLACKLIST_TIME, DOOR_REST_TIME, Blacklist
from dynslam_env.navigation.doors_found import doors_found
from dynslam_env.navigation.frontiers import frontiers
from dynslam_env.navigation.goal import NO_TARGET, Goal, explore, look_at
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from dynslam_env.patrol.observation import AGE_SCALE, MAX_FLIP_RATE

FRONTIER_SLOTS, DOOR_SLOTS = 4, 4
SLOTS = 1 + FRONTIER_SLOTS + DOOR_SLOTS
FEATURES = 7
TURN_ANGLE = math.radians(170)  # of a turn on the spot: less than 180, so always to the left
MAX_PATH_LENGTH = 10.0  # m, path length at which the feature is 1
MAX_FRONTIER_CELLS = 200.0  # size at which the feature is 1


class GoalCandidate(NamedTuple):
    """A goal to choose.

    size   cells of the frontier; 1 for anything else
    age    s since it was seen; inf if never seen
    flips  1/s
    rest   s for which it is not offered again once it was reached
    """

    goal: Goal
    size: float
    age: float
    flips: float
    rest: float


class GoalOptions(NamedTuple):
    """The present goals, `SLOTS` of them: a turn on the spot, which is always there, then frontiers
    by the length of the path, then doors, those unseen longest first; None in an empty slot."""

    planning: PlanningSnapshot
    candidates: tuple[GoalCandidate | None, ...]

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(SLOTS,) whether a slot holds a goal."""
        return np.array([candidate is not None for candidate in self.candidates])

    def chosen(self, slot: int) -> GoalCandidate:
        """The goal in a slot; the turn on the spot if the slot is empty."""
        candidate = self.candidates[slot] or self.candidates[0]
        assert candidate is not None
        return candidate

    def features(self) -> NDArray[np.float32]:
        """(SLOTS, FEATURES) in -1 .. 1; see `DoorPatrolGoalsEnv`."""
        rows = np.zeros((SLOTS, FEATURES), np.float32)
        for row, candidate in zip(rows, self.candidates, strict=True):
            if candidate is not None:
                row[:] = _row(self.planning, candidate)
        return rows


def goal_options(planning: PlanningSnapshot, blacklist: Blacklist) -> GoalOptions:
    """The present goals, without those that the blacklist holds."""

    def first(found: Iterator[GoalCandidate], slots: int) -> list[GoalCandidate | None]:
        fit = (one for one in found if not blacklist.holds(one.goal.target, planning.time))
        taken = list(islice(fit, slots))
        return [*taken, *[None] * (slots - len(taken))]

    explored = first(_frontiers(planning), FRONTIER_SLOTS)
    revisited = first(_doors(planning), DOOR_SLOTS)
    return GoalOptions(planning, (_turn(planning), *explored, *revisited))


def _turn(planning: PlanningSnapshot) -> GoalCandidate:
    row, col = planning.costmap.spec.cell(*planning.position)
    heading = math.remainder(planning.pose.theta + TURN_ANGLE, math.tau)
    return GoalCandidate(Goal((row, col), heading, NO_TARGET), 1.0, 0.0, 0.0, 0.0)


def _frontiers(planning: PlanningSnapshot) -> Iterator[GoalCandidate]:
    found = frontiers(planning.costmap, planning.plan, planning.position)
    for frontier in sorted(found, key=lambda frontier: frontier.length):
        goal = explore(planning, frontier)
        if goal is not None:
            yield GoalCandidate(goal, frontier.size, math.inf, 0.0, BLACKLIST_TIME)


def _doors(planning: PlanningSnapshot) -> Iterator[GoalCandidate]:
    for door in sorted(doors_found(planning.beliefs), key=lambda door: -door.age):
        goal = look_at(planning, door.centre)
        if goal is not None:
            yield GoalCandidate(goal, 1.0, door.age, door.flips, DOOR_REST_TIME)


def _row(planning: PlanningSnapshot, candidate: GoalCandidate) -> tuple[float, ...]:
    goal, pose = candidate.goal, planning.pose
    x, y = goal.target
    bearing = math.atan2(y - pose.y, x - pose.x) - pose.theta
    direction = (math.cos(bearing), math.sin(bearing)) if goal.target != NO_TARGET else (0.0, 0.0)
    return (
        1.0,
        min(float(planning.plan.length[goal.cell]) / MAX_PATH_LENGTH, 1.0),
        *direction,
        min(math.log(candidate.size) / math.log(MAX_FRONTIER_CELLS), 1.0),
        1.0 - math.exp(-candidate.age / AGE_SCALE),
        min(candidate.flips / MAX_FLIP_RATE, 1.0),
    )
