"""DoorPatrol-v0: keep map and pose accurate in a place whose doors move."""

from __future__ import annotations

from typing import Any, Unpack

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dynslam_env.env import DoorWorldEnv
from dynslam_env.navigation.door_belief import DoorBelief
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from dynslam_env.patrol.config import NO_TASK, PatrolConfig, PatrolKeywords
from dynslam_env.patrol.doors_known import DoorsKnown
from dynslam_env.patrol.observation import observation_space
from dynslam_env.patrol.patroller import Patroller
from dynslam_env.patrol.snapshots import snapshot_of
from dynslam_env.simulation.config import check_keywords
from dynslam_env.simulation.robot import Robot
from dynslam_env.slam_wrapper import SlamWrapper
from slam.errors import InputError
from slam.interface import Slam
from slam.scan import Scan

Observation = dict[str, Any]
INFO_KEYS = ("pose", "door_angles", "time", "slam", "split", "index", "faults", "fault_times")
"""Keys of the world's info that a patrol tells."""


class DoorPatrolEnv(gym.Env[Observation, NDArray[np.float32]]):
    """A robot patrols a place whose doors open and close, while a SLAM runs.

    ## Description
    Where doors move, exploration is never finished: an observation a minute old may be wrong. The
    task is to know the pose and the place at all times. A SLAM runs in the environment
    (`SlamWrapper`); beside its map the task keeps a dynamic map of its own in cells of 0.15 m
    (`DynamicMap`, the same for every SLAM), which predicts that changing cells change again. Any
    world can be used: `gym.make("DoorPatrol-v0", world="office", max_episode_steps=1250)`.

    ## Action Space
    `Box(-1, 1, (2,), float32)`: forward velocity (1 is 0.8 m/s) and turning velocity (1 is
    1.5 rad/s), held for 0.4 s. `DoorPatrolGoals-v0` has the same task with discrete goals instead.

    ## Observation Space
    `Dict`, from the robot's sensors and its SLAM alone; nothing of the truth.

    | key            | shape       | what                                                 | range   |
    |----------------|-------------|------------------------------------------------------|---------|
    | `map`          | (4, 40, 40) uint8 | the dynamic map around the robot, pixels of 0.25 m, ahead is up: P(occupied) now (unknown 128), share seen, age (1 - exp(-age / 20 s), 255 unknown), flips (255 is 0.2 a second) | 0 .. 255 |
    | `scan`         | (24,) float32 | nearest echo of each sector, right to left, over the laser's range | 0 .. 1 |
    | `velocity`     | (2,) float32 | forward and turning between the SLAM's last two poses, over those of an action of 1 | -1 .. 1 |
    | `deviations`   | (3,) float32 | of the SLAM's pose along, across, heading; logarithm, 1 mm (mrad) is 0, 1 m (rad) is 1 | 0 .. 1 |
    | `correlations` | (3,) float32 | of across and along, heading and along, heading and across | -1 .. 1 |

    ## Rewards
    A weighted sum of named terms (`RewardWeights`), each in `info["reward_terms"]`, already weighted:

    | term          | weight | what                                                              | unit |
    |---------------|--------|-------------------------------------------------------------------|------|
    | `information` | 0.002  | decrease of the dynamic map's entropy by the scans; that of unobserved doors grows again | bit |
    | `freshness`   | 0.01   | exp(-age / 3 s) of the cells with echoes, weighted 0.1 if a cell never changed and up to 1.1 if it did; times the duration | cell s |
    | `pose`        | 0.05   | decrease of 1/2 log2 det of the SLAM's covariance, down to 5 mm and 0.2 deg | bit |
    | `distance`    | -0.02  | distance by the wheels                                            | m    |
    | `collision`   | -1.0   | share of the step in which the robot touched something            |      |

    ## Starting State
    That of the world; the SLAM begins at the true start.

    ## Episode End
    Never terminated; truncated after 250 steps (100 s), the budget of time.

    ## Information
    `reward_terms`, `time` (s), and, by the truth: `door_brier` (mean squared difference between
    P(closed) by the dynamic map and the truth, over the doors), `pose` (true), `door_angles`,
    `collision` (share of the step), `slam` (see `SlamWrapper`).

    ## Arguments
    Those of `DoorWorldEnv` except `task`, and:

    | argument      | default    | what                                                            |
    |---------------|------------|-----------------------------------------------------------------|
    | `slam`        | "hmm-ml"   | the SLAM variant                                                |
    | `reward`      | `RewardWeights()` | weights of the reward                                    |
    | `speed`, `turn` | 0.8 m/s, 1.5 rad/s | velocities of an action of 1                          |
    | `hold`        | 4          | control steps (0.1 s) for which an action is held               |
    | `scan_every`  | 2          | control steps between two scans given to the SLAM; the dynamic map takes one at least every second control step |
    | `memory`      | `DynamicMap` | makes the dynamic map of an episode, such as `BeliefMap`      |
    | `score_every` | 0          | control steps between two scorings of the SLAM's map, a multiple of `hold`; 0: never. `FinalScores(env)` adds those of the last step |

    ## Version History
    v0: first. `DoorPatrol-v1` (`LongPatrolEnv`) is another task, with doors of minutes, and questions
    of the way; v0 stays. Gymnasium takes the higher number for a successor and would warn at each
    `gym.make` that v0 is out of date: dynslam filters that warning.
    """  # noqa: E501

    metadata = DoorWorldEnv.metadata

    def __init__(
        self,
        *,
        score_every: int = 0,
        render_mode: str | None = None,
        **parts: Unpack[PatrolKeywords],
    ):
        check_keywords(DoorPatrolEnv, PatrolKeywords, parts)
        self.patrol_config, place = PatrolConfig.split(parts)
        self.place = DoorWorldEnv(**place, task=NO_TASK, render_mode=render_mode)
        scan_every, hold = self.patrol_config.scan_every, self.patrol_config.hold
        self.wrapped = SlamWrapper(
            self.place, self.patrol_config.slam, score_every=score_every, scan_every=scan_every
        )
        if score_every % hold:
            raise InputError(
                f"infos are of the end of a step: score_every must be a multiple of hold, "
                f"got {score_every} and {hold}"
            )
        self.render_mode = render_mode
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = observation_space()
        self._patroller: Patroller | None = None

    # -- what an agent may read ----------------------------------------------------------------

    def snapshot(self) -> PatrolSnapshot:
        """What the robot knows now; its maps must be read before the next step."""
        return snapshot_of(self.patroller, self.slam, self._scan, self.robot, self.patrol_config)

    def door_beliefs(self) -> list[DoorBelief]:
        """What the robot believes now of each doorway that it suspects; none with `DynamicMap`."""
        return self.patroller.memory.door_beliefs(self.time)

    @property
    def slam(self) -> Slam:
        """The SLAM of this episode: its `map()`, its `pose`."""
        return self.wrapped.slam

    @property
    def time(self) -> float:
        """s since the episode began."""
        return self.patroller.time

    @property
    def robot(self) -> Robot:
        """The robot's body and the limits of its drive."""
        return self.place.robot

    @property
    def limits(self) -> tuple[float, float]:
        """m/s and rad/s that an action of 1 stands for."""
        return self.patrol_config.limits

    @property
    def period(self) -> float:
        """s for which an action is held."""
        return self.patrol_config.period

    @property
    def patroller(self) -> Patroller:
        """The dynamic map and the SLAM's last estimate."""
        if self._patroller is None:
            raise gym.error.ResetNeeded("there is no patrol before reset()")
        return self._patroller

    # -- gymnasium -----------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start a new episode, deterministic for a given seed. `options` are those of the world."""
        _, info = self.wrapped.reset(seed=seed, options=options)
        self._np_random, self._np_random_seed = self.place.np_random, self.place.np_random_seed
        self._patroller = Patroller(
            self.wrapped.estimate, self.wrapped.scan, self.patrol_config.memory()
        )
        self._doors = DoorsKnown(self.place.layout)
        return self.observation(), self._info(info) | {"collision": 0.0}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold an action for `hold` control steps."""
        reward, info = self.advance(action)
        return self.observation(), reward, False, False, info

    def advance(self, action: NDArray[np.float32]) -> tuple[float, dict[str, Any]]:
        """A step without its observation: reward and info."""
        patroller, patrol_config, info = self.patroller, self.patrol_config, {}
        command = patrol_config.commands(action, self.robot)
        for k in range(1, patrol_config.hold + 1):
            *_, info = self.wrapped.step(command)
            patroller.move(self.place.displacement, info["collision"])
            if not (patrol_config.looked_at(k) and self.place.scan_arrived):
                continue
            if patrol_config.matched(k):
                patroller.look(self.wrapped.estimate, self.wrapped.scan)
            else:
                patroller.skip(self.place.scan)
        gains = patroller.gains(self._scan.time)
        terms = patrol_config.reward.terms(gains)
        told = self._info(info) | {"reward_terms": terms, "collision": gains.collision}
        return sum(terms.values()), told

    @property
    def scored(self) -> bool:
        """Whether the SLAM's map is scored."""
        return self.wrapped.scored

    def finish(self) -> dict[str, Any]:
        """See `SlamWrapper.finish`: `gym.make`'s limit is outside; `FinalScores` calls this."""
        return self.wrapped.finish()

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """The world, and the SLAM's map beside it; see `DoorWorldEnv`."""
        return self.place.render()

    def close(self) -> None:
        """Close the window."""
        self.wrapped.close()

    def observation(self) -> Observation:
        """What the agent observes now."""
        return self.patroller.observation(self._scan, self.patrol_config.limits)

    @property
    def _scan(self) -> Scan:
        """The last scan: that of the SLAM, which took it in, unless none arrived."""
        return self.wrapped.scan if self.place.scan_arrived else self.place.scan

    def _info(self, info: dict[str, Any]) -> dict[str, Any]:
        brier = self._doors.brier(self.patroller.memory, self.time, info["door_angles"])
        known = {key: info[key] for key in INFO_KEYS if key in info}
        return known | {"door_brier": brier}
