"""GoalDriver: the goals of one patrol, and the drive to the chosen one, step by step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dynslam_env.navigation.blacklist import Blacklist
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from dynslam_env.navigation.pilot import REPLAN_PERIOD, Pilot
from dynslam_env.navigation.planning_snapshot import planning_snapshot
from dynslam_env.patrol.goal_options import (
    FEATURES,
    SLOTS,
    GoalCandidate,
    GoalOptions,
    goal_options,
)
from dynslam_env.patrol.observation import observation_space
from slam.errors import InputError
from slam.validation import positive_number


@dataclass(frozen=True)
class GoalConfig:
    """How long decisions and episodes last.

    patience  s, longest decision
    budget    s, of an episode
    """

    patience: float = 4.0
    budget: float = 100.0

    def steps(self, period: float) -> GoalLimits:
        """The same in steps of a patrol of `period` s; raises InputError unless they are whole."""
        return GoalLimits(
            _periods("patience", self.patience, period),
            _periods("budget", self.budget, period),
            math.ceil(REPLAN_PERIOD / period),
        )


class GoalLimits(NamedTuple):
    """Steps of the patrol.

    patience  of the longest decision
    budget    of an episode
    replan    between two plans
    """

    patience: int
    budget: int
    replan: int


class Decision(NamedTuple):
    """What the steps of a decision told, of each step.

    rewards     of the patrol
    terms       of these, by name
    brier       of the doors
    collisions  share of the step in which the robot touched something
    """

    rewards: list[float]
    terms: list[dict[str, float]]
    brier: list[float]
    collisions: list[float]

    @staticmethod
    def begun() -> Decision:
        """A decision without steps."""
        return Decision([], [], [], [])

    def add(self, reward: float, terms: dict[str, float], brier: float, collision: float) -> None:
        """Add a step."""
        self.rewards.append(reward)
        self.terms.append(terms)
        self.brier.append(brier)
        self.collisions.append(collision)

    @property
    def reward(self) -> float:
        """Of the whole decision."""
        return sum(self.rewards)

    @property
    def reward_terms(self) -> dict[str, float]:
        """Of the whole decision, by name."""
        return {name: sum(term[name] for term in self.terms) for name in self.terms[0]}

    @property
    def means(self) -> tuple[float, float]:
        """Brier score of the doors, and share of the time with contact."""
        return float(np.mean(self.brier)), float(np.mean(self.collisions))


class GoalDriver:
    """Drives one robot to the goals that an agent chooses.

    rng  of the pilot's recoveries
    """

    def __init__(self, limits: GoalLimits, rng: np.random.Generator):
        self._limits = limits
        self._pilot, self._blacklist = Pilot(rng), Blacklist()
        self._options: GoalOptions | None = None
        self._driven = self._steps = 0  # of the episode, of the decision

    @property
    def options(self) -> GoalOptions:
        """The goals that can be chosen now."""
        if self._options is None:
            raise gym.error.ResetNeeded("there are no goals before reset()")
        return self._options

    @property
    def steps(self) -> int:
        """Of the present decision, or the last one."""
        return self._steps

    @property
    def driven(self) -> int:
        """Steps of the episode."""
        return self._driven

    @property
    def over(self) -> bool:
        """Whether the budget is used up."""
        return self._driven >= self._limits.budget

    def look(self, snapshot: PatrolSnapshot) -> dict[str, Any]:
        """Find the goals that can be chosen now; what the observation has of them."""
        self._options = options = goal_options(planning_snapshot(snapshot), self._blacklist)
        return {"goals": options.features(), "action_mask": options.mask.astype(np.int8)}

    def choose(self, slot: int) -> None:
        """Begin a decision."""
        self._chosen = self.options.chosen(slot)
        self._pilot.go(self._chosen.goal, self.options.planning)
        self._steps = 0

    def action(self, snapshot: PatrolSnapshot) -> NDArray[np.float32]:
        """(2,) the next action of the patrol."""
        return self._pilot.action(snapshot)

    def goes_on(self, snapshot: PatrolSnapshot) -> bool:
        """After a step of the patrol: whether the decision goes on; replan in time."""
        self._steps, self._driven = self._steps + 1, self._driven + 1
        unfinished = self._unfinished(self._chosen, snapshot)
        return unfinished and self._steps < self._limits.patience and not self.over

    def _unfinished(self, chosen: GoalCandidate, snapshot: PatrolSnapshot) -> bool:
        pilot = self._pilot
        if pilot.stuck:
            self._blacklist.add(chosen.goal.target, snapshot.time)
            pilot.halt()
        elif self._steps % self._limits.replan == 0:
            pilot.replan(planning_snapshot(snapshot))
        return pilot.recovering(snapshot) or (
            pilot.goal is not None and not pilot.arrived(snapshot)
        )

    def arrived(self, snapshot: PatrolSnapshot) -> bool:
        """At the end of a decision: whether the goal was reached, which then rests."""
        reached = self._pilot.arrived(snapshot)
        if reached:
            self._blacklist.add(self._chosen.goal.target, snapshot.time, self._chosen.rest)
        return reached


def goals_space() -> spaces.Dict:
    """The observation space of a patrol with goals."""
    return spaces.Dict(
        {
            **observation_space().spaces,
            "goals": spaces.Box(-1.0, 1.0, (SLOTS, FEATURES), np.float32),
            "action_mask": spaces.MultiBinary(SLOTS),
        }
    )


def slots_of(actions: Sequence[Any], space: spaces.Space[Any]) -> list[int]:
    """Actions of `space` as slots; raises InputError for any other."""
    for action in actions:
        if not space.contains(action):
            raise InputError(f"actions are whole numbers from 0 to {SLOTS - 1}, got {action!r}")
    return [int(action) for action in actions]


def _periods(name: str, seconds: float, period: float) -> int:
    """`seconds` as a number of periods; raises InputError unless it is a whole number."""
    positive_number(name, seconds)
    periods = round(seconds / period)
    if not periods or not math.isclose(periods * period, seconds):
        raise InputError(f"{name} must be a multiple of {period:g} s, got {seconds!r}")
    return periods
