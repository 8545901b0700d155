"""SlamWrapper: runs a SLAM in an environment, and scores it against the ground truth."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dynslam_env.drawing.scene import Belief
from dynslam_env.env import DoorWorldEnv, Observation
from dynslam_env.slam_run import SlamRun, SlamView, builder_of, errors_of
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.interface import Builder, Estimate, Slam
from slam.metrics.mapping import score_map
from slam.metrics.surface import SeenSurface
from slam.scan import Scan
from slam.validation import whole_number


class SlamWrapper(
    gym.Wrapper[Observation, NDArray[np.float32], Observation, NDArray[np.float32]],
    gym.utils.RecordConstructorArgs,
):
    """Runs a SLAM on the scans and odometry of an environment, and scores it.

    The wrapper adds the estimate and its scores to `info`, and on request a local map and the
    estimated pose to the observation. With a `render_mode`, the map is drawn beside the world.
    While no scan arrives (see `Gap`), the SLAM waits, and the next scan comes with the odometry since
    the last one.

    ```python
    env = dynslam_env.SlamWrapper(gym.make("DoorCorridor-v0"), slam="dynamic-ml", map_crop=4.0)
    ```

    ## Arguments
    | argument        | type, default | content                                                     |
    |-----------------|---------------|-------------------------------------------------------------|
    | `env`           | environment   | one of `DoorWorldEnv`, wrapped or not                       |
    | `slam`          | "dynamic-ml"  | name of a registered variant, or a builder (start, rng) -> Slam |
    | `score_every`   | 10            | steps between two scorings of the map; 0: never             |
    | `scan_every`    | 1             | the SLAM processes every so many-th scan and the last one of an episode; in between, `info["slam"]` repeats its last values |
    | `map_crop`      | None          | side in m of a square of the map around the robot, added to the observation as `map` |
    | `map_cell`      | 0.05          | side in m of a cell of `map`                                |
    | `pose_estimate` | False         | whether to add the estimated pose to the observation as `pose_estimate` |
    | `seed`          | 0             | seed of the SLAM in every episode                           |

    ## Observation Space
    That of the environment, and on request:

    | key             | shape, dtype       | content                                                |
    |-----------------|--------------------|--------------------------------------------------------|
    | `map`           | (1, n, n), uint8   | 0 free, 255 occupied, 128 unknown; the robot is at the centre and faces up |
    | `pose_estimate` | (3,), float32      | estimated x, y, theta in m, m, rad                     |

    ## Information
    `info["slam"]` after every reset and step:

    | key              | content                                                     | unit      |
    |------------------|-------------------------------------------------------------|-----------|
    | `pose`           | (3,) estimated x, y, theta; starts at the true pose         | m, m, rad |
    | `position_error` | distance to the true position                               | m         |
    | `heading_error`  | estimate minus truth, wrapped to -pi .. pi                  | rad       |
    | `matched`        | whether the SLAM matched this scan                          |           |
    | `revised`        | whether the SLAM changed its estimates of earlier poses     |           |
    | `lost`           | probability that the pose, within its map, is off by more than 0.3 m or 10 degrees | |
    | `drift`          | by which the pose was moved at this scan, since the map had drifted; else 0 | m |
    | `f1_5cm`, `f1_10cm`, ... | the scores of `slam.metrics.mapping.MapScores` against the current world, and of `slam.metrics.change.ChangeScores` against the world over time; at reset, at every `score_every`-th step, and at the end of the episode (see `finish`) | |
    """  # noqa: E501

    def __init__(
        self,
        env: gym.Env[Observation, NDArray[np.float32]],
        slam: str | Builder = "dynamic-ml",
        *,
        score_every: int = 10,
        scan_every: int = 1,
        map_crop: float | None = None,
        map_cell: float = 0.05,
        pose_estimate: bool = False,
        seed: int = 0,
    ):
        gym.utils.RecordConstructorArgs.__init__(
            self, slam=slam, score_every=score_every, scan_every=scan_every, map_crop=map_crop,
            map_cell=map_cell, pose_estimate=pose_estimate, seed=seed,
        )  # fmt: skip
        super().__init__(env)
        world = env.unwrapped
        if not isinstance(world, DoorWorldEnv):
            raise InputError(f"SlamWrapper needs an environment of dynslam_env, got {world}")
        whole_number("score_every", score_every, 0)
        whole_number("scan_every", scan_every, 1)
        self._world, self._score_every, self._scan_every = world, score_every, scan_every
        self._name = slam if isinstance(slam, str) else "slam"
        self._build = builder_of(slam, seed)
        self._build(Pose2())  # raises for an unknown name now, not at the first reset
        self._added = SlamView.of(map_crop, map_cell, pose_estimate)
        assert isinstance(env.observation_space, spaces.Dict)
        keys = {**env.observation_space.spaces, **self._added.spaces()}
        self.observation_space = spaces.Dict(keys)
        self._run: SlamRun | None = None
        world.belief = self._belief

    @property
    def slam(self) -> Slam:
        """The SLAM of this episode."""
        return self._begun.slam

    @property
    def estimate(self) -> Estimate:
        """The estimate of the SLAM after the last scan that it processed."""
        return self._begun.estimate

    @property
    def scan(self) -> Scan:
        """The last scan that the SLAM processed."""
        return self._begun.scan

    @property
    def _begun(self) -> SlamRun:
        if self._run is None:
            raise gym.error.ResetNeeded("SlamWrapper has no SLAM before reset()")
        return self._run

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start a new episode with a new SLAM, which processes the first scan at the true start."""
        self._run = None
        observation, info = self.env.reset(seed=seed, options=options)
        self._run = SlamRun(self._build(self._world.pose), self._world, self._scan_every)
        self._seen: SeenSurface | None = None
        return self._extended(observation, info, scored=self._score_every > 0)

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """Step the environment, then the SLAM."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        run = self._begun
        run.step()
        every, ended = self._score_every, terminated or truncated
        score_now = every > 0 and (run.steps % every == 0 or ended)
        if ended:
            run.finish()
        observation, info = self._extended(observation, info, scored=score_now)
        return observation, reward, terminated, truncated, info

    def finish(self) -> dict[str, Any]:
        """The final `info["slam"]` of an episode that something outside of the wrapper ended.

        The wrapper sees the end of an episode, and scores it, where the environment that it wraps
        ends it, as one of `gym.make` does. It does not see a limit around itself, as in
        `TimeLimit(SlamWrapper(env), 100)`: call this after the last step, or let `FinalScores`.
        """
        self._begun.finish()
        return self._begun.result | (self._scores(self.slam.map()) if self.scored else {})

    @property
    def scored(self) -> bool:
        """Whether the map is scored."""
        return self._score_every > 0

    def _extended(
        self, observation: Observation, info: dict[str, Any], *, scored: bool
    ) -> tuple[Observation, dict[str, Any]]:
        """The observation and info, extended by the results of the SLAM."""
        world, run = self._world, self._begun
        result = dict(run.result)
        if self._score_every:
            self._record_seen_surface()
        if scored:
            result |= self._scores(self.slam.map())
        if world.render_mode == "human":
            world.render()
        return observation | self._added.observation(run), info | {"slam": result}

    # -- scores --------------------------------------------------------------------------------

    def _record_seen_surface(self) -> None:
        """Record the surfaces that the scan has seen: the map is scored against them."""
        world = self._world
        if self._seen is None:
            self._seen = SeenSurface(world.layout.walls)
        self._seen.see(world.scan, world.pose)

    def _scores(self, grid: OccupancyGrid) -> dict[str, Any]:
        assert self._seen is not None
        change = self._world.occupancy(grid.spec.resolution).score(grid)
        surface = self._seen.now(self._world.outline())
        return score_map(grid, surface).as_dict() | change.as_dict()

    # -- drawing -------------------------------------------------------------------------------

    def _belief(self) -> Belief | None:
        if self._run is None:
            return None
        slam = self._run.slam
        error = errors_of(slam.pose, self._world.pose)
        off, turned = error["position_error"], abs(math.degrees(error["heading_error"]))
        title = f"{self._name}   off by {off:.2f} m, {turned:.1f} deg"
        return Belief(slam.map(), slam.pose, self._run.trail, title)


class FinalScores(gym.Wrapper[Any, Any, Any, Any], gym.utils.RecordConstructorArgs):
    """Adds the final scores to `info["slam"]` where a time limit around `SlamWrapper` ends an
    episode: `FinalScores(TimeLimit(SlamWrapper(env), 100))`, or
    `FinalScores(gym.make("DoorPatrol-v0", score_every=200))`, whose SLAM is inside of its limit.
    """

    def __init__(self, env: gym.Env[Any, Any]):
        """`env` has `SlamWrapper`'s `finish` and `scored`."""
        gym.utils.RecordConstructorArgs.__init__(self)
        super().__init__(env)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and score the end."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        if (terminated or truncated) and self.env.get_wrapper_attr("scored"):
            info = info | {"slam": self.env.get_wrapper_attr("finish")()}
        return observation, reward, terminated, truncated, info
