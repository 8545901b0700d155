"""DoorPatrol-v1: know the doors of a floor, over ten minutes and more, and answer for the way."""

from __future__ import annotations

from typing import Any, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from dynslam_env.patrol.belief_map import BeliefMap
from dynslam_env.patrol.config import PatrolKeywords
from dynslam_env.patrol.doors_known import CLOSED_ANGLE, closed
from dynslam_env.patrol.env import DoorPatrolEnv, Observation
from dynslam_env.patrol.questions import Questions
from dynslam_env.patrol.slow_doors import SlowDoors

QUESTION_PERIOD = 10.0  # s, mean time between two questions; the times are random
LONG_PATROL: PatrolKeywords = {"world": "office", "doors": SlowDoors(), "memory": BeliefMap}
"""Keywords of `LongPatrolEnv` that differ from those of `DoorPatrolEnv`."""


class LongPatrolEnv(DoorPatrolEnv):
    """A robot patrols a floor whose doors stay open or closed for minutes, and is asked for ways.

    ## Description
    The task, sensors, actions and reward of `DoorPatrol-v0`, with doors slow enough that driving to
    them pays: each door has habits of its own between 60 and 400 s, and some follow another
    (`SlowDoors`). The belief knows doors (`BeliefMap`). At random times, every 10 s on average, a
    question is asked: the way from one place of the floor to another. The answer is driven in
    thought, by the belief at that moment (`Questions`); what it takes longer than the best way
    through the doors that are open then is the regret. Any world can be used:
    `gym.make("DoorPatrol-v1", world="loop")`, with `difficulty="hard"` for larger floors.
    Floors are drawn by seed, or by split: those of "train" are never those of "test".

    ## Action Space, Observation Space, Rewards, Starting State
    Those of `DoorPatrolEnv`.

    ## Episode End
    Never terminated; truncated after 1500 steps (600 s). `max_episode_steps=4500` makes it half an
    hour.

    ## Information
    Those of `DoorPatrolEnv`, and after each step:

    | key         | what                                                              |
    |-------------|-------------------------------------------------------------------|
    | `regrets`   | list of s, the regret of each question that was asked in the step |

    ## Arguments
    Those of `DoorPatrolEnv`; the defaults of `world`, `doors` and `memory` are "office",
    `SlowDoors()` and `BeliefMap`.

    ## Version History
    v1: first. `DoorPatrol-v0` has doors of 5 to 20 s, with which standing still is best; it is
    another task, and stays.
    """

    def __init__(
        self,
        *,
        score_every: int = 0,
        render_mode: str | None = None,
        **parts: Unpack[PatrolKeywords],
    ):
        given = {name: part for name, part in parts.items() if part is not None}
        whole = cast(PatrolKeywords, {**LONG_PATROL, **given})
        super().__init__(score_every=score_every, render_mode=render_mode, **whole)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """See `DoorPatrolEnv`."""
        observation, info = super().reset(seed=seed, options=options)
        walls = self.place.layout.walls
        self._asking = np.random.default_rng(np.frombuffer(walls.tobytes(), np.uint32))
        self._questions: Questions | None = None  # the first step makes them
        return observation, info

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """See `DoorPatrolEnv`."""
        observation, reward, ended, cut, info = super().step(action)
        return observation, reward, ended, cut, info | {"regrets": self._regrets(info)}

    def _regrets(self, info: dict[str, Any]) -> list[float]:
        if self._questions is None:
            self._questions = Questions(self.place.layout, self.robot.radius, self._asking)
        questions = self._questions
        count = self._asking.poisson(self.period / QUESTION_PERIOD)
        if not count or not len(info["door_angles"]):
            return []
        believed = closed(self._doors.near(self.patroller.memory, self.time))
        is_open = info["door_angles"] >= CLOSED_ANGLE
        asked = [questions.regret(believed, is_open) for _ in range(count)]
        return [lost for lost in asked if lost is not None]
