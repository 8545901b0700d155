"""Door inspection: visits the doors found, in turn or by the time since each was seen."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from agents.goal_choosers.frontiers import FrontierChooser, nearest
from agents.goal_choosers.goal_agent import look_around
from dynslam_env.navigation.blacklist import BLACKLIST_TIME, DOOR_REST_TIME, Blacklist
from dynslam_env.navigation.doors_found import FoundDoor, doors_found
from dynslam_env.navigation.goal import Goal, look_at
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot

PATH_SPEED = 0.5  # m/s, assumed along a path
DOOR_OVERHEAD = 3.0  # s, for turning and accelerating, on any path to a door
MIN_DOORS = 3  # with fewer doors known, it explores
SAME_DOOR_DISTANCE = 0.7  # m: centres no farther apart are those of one door
MIN_AGE = 5.0  # s: a door seen more recently is skipped while frontiers remain
SWITCH_RATIO = 1.25  # factor by which another door must be better than the present goal
EXPLORE_TIME = 15.0  # s of exploration after each round, while frontiers remain


class DoorVisit(NamedTuple):
    """A door that can be looked at from `goal`, which takes `time` s to reach."""

    door: FoundDoor
    goal: Goal
    time: float


class DoorOrder(Protocol):
    """The order in which doors are visited."""

    def pick(self, visits: list[DoorVisit], time: float) -> DoorVisit | None:
        """The next of `visits`, at `time`, s; None to explore instead."""
        ...

    def ended(self, goal: Goal, time: float) -> None:
        """The robot reached the goal, or was stuck before."""
        ...


class RoundRobin:
    """Each door once a round, always the nearest of the remaining ones."""

    def __init__(self) -> None:
        self._visited: list[tuple[float, float]] = []
        self._last: tuple[float, float] | None = None
        self._exploring_until = -math.inf

    def pick(self, visits: list[DoorVisit], time: float) -> DoorVisit | None:
        """See `DoorOrder`."""
        if time < self._exploring_until:
            return None
        left = [visit for visit in visits if not _any_near(visit.goal.target, self._visited)]
        if not left:
            self._visited.clear()
            self._exploring_until = time + EXPLORE_TIME
            return None
        picked = min(left, key=self._cost)
        self._last = picked.goal.target
        return picked

    def ended(self, goal: Goal, time: float) -> None:
        """See `DoorOrder`."""
        self._visited.append(goal.target)
        self._last = None

    def _cost(self, visit: DoorVisit) -> float:
        last = [self._last] if self._last else []
        return visit.time * (1 if _any_near(visit.goal.target, last) else SWITCH_RATIO)


class LongestUnseen:
    """The door with the largest ratio of age to travel time."""

    def __init__(self) -> None:
        self._last: tuple[float, float] | None = None

    def pick(self, visits: list[DoorVisit], time: float) -> DoorVisit | None:
        """See `DoorOrder`."""
        stale = [visit for visit in visits if visit.door.age >= MIN_AGE]
        if not stale:
            return None
        picked = max(stale, key=self._value)
        self._last = picked.goal.target
        return picked

    def ended(self, goal: Goal, time: float) -> None:
        """See `DoorOrder`."""
        self._last = None

    def _value(self, visit: DoorVisit) -> float:
        last = [self._last] if self._last else []
        ratio = SWITCH_RATIO if _any_near(visit.goal.target, last) else 1.0
        return visit.door.age / visit.time * ratio


class DoorChooser:
    """Visits the doors found in a given order; explores the nearest frontiers until it knows some.

    order  of the doors
    """

    def __init__(self, order: DoorOrder):
        self._order, self._explorer = order, FrontierChooser(nearest)
        self._blacklist = Blacklist()
        self._exploring = True

    def goal(self, planning: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        visits = self._visits(planning)
        picked = self._order.pick(visits, planning.time) if len(visits) >= MIN_DOORS else None
        goal = picked.goal if picked else self._explorer.goal(planning)
        self._exploring = picked is None
        if goal is not None or not visits:
            return goal or look_around(planning)
        self._exploring = False
        return max(visits, key=lambda visit: visit.door.age / visit.time).goal

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`."""
        if self._exploring:
            self._explorer.ended(goal, reached, time)
            return
        self._order.ended(goal, time)
        self._blacklist.add(goal.target, time, DOOR_REST_TIME if reached else BLACKLIST_TIME)

    def _visits(self, planning: PlanningSnapshot) -> list[DoorVisit]:
        visits = []
        for door in doors_found(planning.beliefs):
            goal = look_at(planning, door.centre)
            if goal and not self._blacklist.holds(goal.target, planning.time):
                visits.append(DoorVisit(door, goal, time_to(goal, planning)))
        return visits


def time_to(goal: Goal, planning: PlanningSnapshot) -> float:
    """s to reach a goal."""
    return float(planning.plan.length[goal.cell]) / PATH_SPEED + DOOR_OVERHEAD


def _any_near(target: tuple[float, float], places: list[tuple[float, float]]) -> bool:
    return any(math.dist(target, place) < SAME_DOOR_DISTANCE for place in places)
