"""Which of the doors found to look at: round robin, or the one unseen longest."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from agents.goal_choosers.frontiers import FrontierChooser, nearest
from agents.goal_choosers.goal_agent import look_around
from dynslam_env.navigation.blacklist import FORGET, LOOKED, Blacklist
from dynslam_env.navigation.doors_found import FoundDoor, doors_found
from dynslam_env.navigation.goal import Goal, look_at
from dynslam_env.navigation.survey import PlanningSnapshot

SPEED = 0.5  # m/s, that a way takes
TURN_TIME = 3.0  # s, for turning and speeding up, on any way
ENOUGH = 3  # doors: with fewer it explores
SAME = 0.7  # m: centres no farther apart are those of one door
FRESH = 5.0  # s: a door seen so lately is not looked at again while frontiers are left
KEEP = 1.25  # times: so much better another door must be than the one it is driving to
EXPLORE = 15.0  # s, of exploring after each round, while frontiers are left


class Look(NamedTuple):
    """A door that can be looked at from `goal`, some `time` s away."""

    door: FoundDoor
    goal: Goal
    time: float


class Order(Protocol):
    """Which door comes next."""

    def pick(self, looks: list[Look], time: float) -> Look | None:
        """One of `looks`, at `time`, s; None to explore instead."""
        ...

    def ended(self, goal: Goal, time: float) -> None:
        """The robot was at the goal, or could not get there."""
        ...


class RoundRobin:
    """Each door once a round, always the nearest of those whose turn is still to come."""

    def __init__(self) -> None:
        self._visited: list[tuple[float, float]] = []
        self._last: tuple[float, float] | None = None
        self._exploring_until = -math.inf

    def pick(self, looks: list[Look], time: float) -> Look | None:
        """See `Order`."""
        if time < self._exploring_until:
            return None
        due = [look for look in looks if not _any_near(look.goal.target, self._visited)]
        if not due:
            self._visited.clear()
            self._exploring_until = time + EXPLORE
            return None
        last = [self._last] if self._last else []
        look = min(
            due, key=lambda look: look.time * (1 if _any_near(look.goal.target, last) else KEEP)
        )
        self._last = look.goal.target
        return look

    def ended(self, goal: Goal, time: float) -> None:
        """See `Order`."""
        self._visited.append(goal.target)
        self._last = None


class LongestUnseen:
    """The door of the largest age for each second that it takes to get there."""

    def __init__(self) -> None:
        self._last: tuple[float, float] | None = None

    def pick(self, looks: list[Look], time: float) -> Look | None:
        """See `Order`."""
        stale = [look for look in looks if look.door.age >= FRESH]
        if not stale:
            return None
        look = max(stale, key=self._value)
        self._last = look.goal.target
        return look

    def ended(self, goal: Goal, time: float) -> None:
        """See `Order`."""
        self._last = None

    def _value(self, look: Look) -> float:
        last = [self._last] if self._last else []
        return look.door.age / look.time * (KEEP if _any_near(look.goal.target, last) else 1.0)


class DoorChooser:
    """Looks at the doors found in some order; explores the nearest frontiers until it knows some.

    order  which door comes next
    """

    def __init__(self, order: Order):
        self._order, self._explore = order, FrontierChooser(nearest)
        self._blacklist = Blacklist()
        self._exploring = True

    def goal(self, survey: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        looks = self._looks(survey)
        picked = self._order.pick(looks, survey.time) if len(looks) >= ENOUGH else None
        goal = picked.goal if picked else self._explore.goal(survey)
        self._exploring = picked is None
        if goal is not None or not looks:
            return goal or look_around(survey)
        self._exploring = False
        return max(looks, key=lambda look: look.door.age / look.time).goal

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`."""
        if self._exploring:
            self._explore.ended(goal, reached, time)
            return
        self._order.ended(goal, time)
        self._blacklist.add(goal.target, time, LOOKED if reached else FORGET)

    def _looks(self, survey: PlanningSnapshot) -> list[Look]:
        looks = []
        for door in doors_found(survey.beliefs):
            goal = look_at(survey, door.centre)
            if goal and not self._blacklist.holds(goal.target, survey.time):
                looks.append(Look(door, goal, time_to(goal, survey)))
        return looks


def time_to(goal: Goal, survey: PlanningSnapshot) -> float:
    """s that it takes to get there."""
    return float(survey.plan.length[goal.cell]) / SPEED + TURN_TIME


def _any_near(target: tuple[float, float], places: list[tuple[float, float]]) -> bool:
    return any(math.dist(target, place) < SAME for place in places)
