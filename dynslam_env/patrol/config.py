"""PatrolConfig: SLAM, action limits and reward of a patrol."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynslam_env.patrol.memory import DynamicMap
from dynslam_env.patrol.rewards import RewardWeights
from dynslam_env.simulation.config import PlaceKeywords, split_keywords
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.task import Task
from dynslam_env.simulation.world import CONTROL_DT
from dynslam_env.simulation.world_batch import actions_of
from slam.errors import InputError
from slam.validation import instance, positive, whole_number

NO_TASK = Task(reward={}, ends=())  # the patrol has its own reward, and ends by time only
LOOK_EVERY = 2  # control steps at most between two scans of the dynamic map: with 4, `lookout` errs
# by 0.18 instead of 0.13 (Brier score of the doors)


class PatrolKeywords(PlaceKeywords, total=False):
    """Keywords of every patrol."""

    slam: str
    speed: float
    turn: float
    hold: int
    scan_every: int
    memory: Callable[[], DynamicMap]
    reward: RewardWeights | None


@dataclass(frozen=True)
class PatrolConfig:
    """SLAM, action limits and reward of a patrol.

    slam        name of the SLAM variant
    speed       m/s that an action of 1 stands for
    turn        rad/s that an action of 1 stands for
    hold        control steps of 0.1 s for which an action is held
    scan_every  control steps between two scans given to the SLAM; `hold` is a multiple of it. The
                dynamic map takes a scan at least every second control step
    memory      makes the dynamic map of an episode: `DynamicMap`, or `BeliefMap`, or a function
    reward      weights of the reward
    """

    slam: str = "hmm-ml"
    speed: float = 0.8
    turn: float = 1.5
    hold: int = 4
    scan_every: int = 2
    memory: Callable[[], DynamicMap] = DynamicMap
    reward: RewardWeights = field(default_factory=RewardWeights)

    def __post_init__(self) -> None:
        positive(self, "speed", "turn")
        whole_number("hold", self.hold, 1)
        whole_number("scan_every", self.scan_every, 1)
        if self.hold % self.scan_every:
            raise InputError(
                f"an agent acts on the last scan: hold must be a multiple of scan_every, "
                f"got {self.hold} and {self.scan_every}"
            )
        instance("reward", self.reward, RewardWeights)

    @staticmethod
    def split(keywords: Mapping[str, Any]) -> tuple[PatrolConfig, dict[str, Any]]:
        """The patrol's share of `PatrolKeywords` as a config, and the rest, the place's."""
        reward = keywords.get("reward") or RewardWeights()
        return split_keywords(PatrolConfig, {**keywords, "reward": reward})

    @property
    def limits(self) -> tuple[float, float]:
        """m/s and rad/s that an action of 1 stands for."""
        return self.speed, self.turn

    @property
    def period(self) -> float:
        """s for which an action is held."""
        return self.hold * CONTROL_DT

    def matched(self, step: int) -> bool:
        """Whether the SLAM takes the scan of a control step, 1 to `hold`."""
        return step % self.scan_every == 0

    def looked_at(self, step: int) -> bool:
        """Whether the dynamic map takes the scan of a control step, 1 to `hold`."""
        return step % LOOK_EVERY == 0 or self.matched(step)

    def commands(self, actions: NDArray[Any], robot: Robot) -> NDArray[Any]:
        """Actions (..., 2) of the patrol as actions of the robot; raises InputError for values that
        are not finite."""
        shape = (*np.shape(actions)[:-1], 2)
        given = np.clip(actions_of(actions, shape), -1.0, 1.0)
        return given * (self.speed / robot.max_speed, self.turn / robot.max_turn)
