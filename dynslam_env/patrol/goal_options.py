"""Menu: the goals that a patrol may choose among, and how they are shown."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.blacklist import FORGET, LOOKED, Blacklist
from dynslam_env.navigation.doors_found import doors_found
from dynslam_env.navigation.frontiers import frontiers
from dynslam_env.navigation.goal import NOTHING, Goal, explore, look_at
from dynslam_env.navigation.survey import PlanningSnapshot
from dynslam_env.patrol.observation import FADES, OFTEN

FRONTIERS, DOORS = 4, 4
SLOTS = 1 + FRONTIERS + DOORS
FEATURES = 7
ROUND = math.radians(170)  # of a turn on the spot: always to the left, and no more than is seen
FAR = 10.0  # m, of a way that is shown as 1
LARGE = 200.0  # cells, of a frontier that is shown as 1


class GoalCandidate(NamedTuple):
    """Something to choose.

    size   cells of the frontier; 1 where it is none
    age    s since it was seen; inf where it never was
    flips  1/s
    rest   s for which it is not offered again once it was looked at
    """

    goal: Goal
    size: float
    age: float
    flips: float
    rest: float


class GoalOptions(NamedTuple):
    """What there is to choose, `SLOTS` of them: a turn on the spot, which there always is, then
    frontiers, the nearest by the way first, then doors, those unseen longest first; None in a slot
    that is empty."""

    survey: PlanningSnapshot
    offers: tuple[GoalCandidate | None, ...]

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(SLOTS,) whether there is something."""
        return np.array([offer is not None for offer in self.offers])

    def chosen(self, slot: int) -> GoalCandidate:
        """What is in a slot; in an empty one the turn."""
        offer = self.offers[slot] or self.offers[0]
        assert offer is not None
        return offer

    def shown(self) -> NDArray[np.float32]:
        """(SLOTS, FEATURES) in -1 .. 1; see `DoorPatrolGoalsEnv`."""
        rows = np.zeros((SLOTS, FEATURES), np.float32)
        for row, offer in zip(rows, self.offers, strict=True):
            if offer is not None:
                row[:] = _row(self.survey, offer)
        return rows


def menu(survey: PlanningSnapshot, blacklist: Blacklist) -> GoalOptions:
    """What there is now; nothing that the blacklist holds."""

    def first(found: Iterator[GoalCandidate], slots: int) -> list[GoalCandidate | None]:
        fit = (offer for offer in found if not blacklist.holds(offer.goal.target, survey.time))
        taken = list(islice(fit, slots))
        return [*taken, *[None] * (slots - len(taken))]

    explored, revisited = first(_frontiers(survey), FRONTIERS), first(_doors(survey), DOORS)
    return GoalOptions(survey, (_turn(survey), *explored, *revisited))


def _turn(survey: PlanningSnapshot) -> GoalCandidate:
    row, col = survey.costmap.spec.cells(np.array([survey.position]))[0].tolist()
    heading = math.remainder(survey.pose.theta + ROUND, math.tau)
    return GoalCandidate(Goal((row, col), heading, NOTHING), 1.0, 0.0, 0.0, 0.0)


def _frontiers(survey: PlanningSnapshot) -> Iterator[GoalCandidate]:
    found = frontiers(survey.costmap, survey.plan, survey.position)
    for frontier in sorted(found, key=lambda frontier: frontier.length):
        goal = explore(survey, frontier)
        if goal is not None:
            yield GoalCandidate(goal, frontier.size, math.inf, 0.0, FORGET)


def _doors(survey: PlanningSnapshot) -> Iterator[GoalCandidate]:
    for door in sorted(doors_found(survey.beliefs), key=lambda door: -door.age):
        goal = look_at(survey, door.centre)
        if goal is not None:
            yield GoalCandidate(goal, 1.0, door.age, door.flips, LOOKED)


def _row(survey: PlanningSnapshot, offer: GoalCandidate) -> tuple[float, ...]:
    x, y = offer.goal.target
    bearing = math.atan2(y - survey.pose.y, x - survey.pose.x) - survey.pose.theta
    aside = (math.cos(bearing), math.sin(bearing)) if offer.goal.target != NOTHING else (0.0, 0.0)
    return (
        1.0,
        min(float(survey.plan.length[offer.goal.cell]) / FAR, 1.0),
        *aside,
        min(math.log(offer.size) / math.log(LARGE), 1.0),
        1.0 - math.exp(-offer.age / FADES),
        min(offer.flips / OFTEN, 1.0),
    )
