"""SlamWrapper: runs a SLAM in an environment, and scores it against the ground truth."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

import slam as slam_library
from dynslam_env.drawing.scene import Belief
from dynslam_env.env import DoorWorldEnv, Observation
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.interface import Builder, Estimate, Revising, Sampled, Slam, believed
from slam.kernel import kernel
from slam.metrics.mapping import score_map
from slam.metrics.surface import SeenSurface
from slam.validation import positive_number, whole_number

MAX_POSITION = 1000.0  # m, bound of the pose estimate in the observation
MIN_CROP = 36  # cells, the smallest image of stable-baselines3's CNN


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
        positive_number("map_cell", map_cell)
        if map_crop is not None:
            positive_number("map_crop", map_crop)
        self._world, self._score_every, self._scan_every = world, score_every, scan_every
        self._name = slam if isinstance(slam, str) else "slam"
        self._build = _builder(slam, seed)
        self._build(Pose2())  # raises for an unknown name now, not at the first reset
        self._crop = crop_points(map_crop, map_cell) if map_crop is not None else None
        self._with_pose = pose_estimate
        self.observation_space = self._extended_space(env.observation_space)
        self._slam: Slam | None = None
        world.belief = self._belief

    @property
    def slam(self) -> Slam:
        """The SLAM of this episode."""
        if self._slam is None:
            raise gym.error.ResetNeeded("SlamWrapper has no SLAM before reset()")
        return self._slam

    @property
    def estimate(self) -> Estimate:
        """The estimate of the SLAM after the last scan that it processed."""
        _ = self.slam
        return self._estimate

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start a new episode with a new SLAM, which processes the first scan at the true start."""
        self._slam = None
        observation, info = self.env.reset(seed=seed, options=options)
        self._slam = self._build(self._world.pose)
        self._sampled = self._slam if isinstance(self._slam, Sampled) else None  # slow to ask
        self._seen: SeenSurface | None = None
        self._trail: list[Pose2] = []
        self._steps, self._moved = 0, Pose2()
        self._update_slam()
        return self._extended(observation, info, scored=self._score_every > 0)

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """Step the environment, then the SLAM."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._steps += 1
        every, ended = self._score_every, terminated or truncated
        score_now = every > 0 and (self._steps % every == 0 or ended)
        self._moved = self._moved @ self._world.displacement
        self._waiting = self._world.scan_arrived
        if self._waiting and self._steps % self._scan_every == 0:
            self._update_slam()
        if ended:
            self._end()
        observation, info = self._extended(observation, info, scored=score_now)
        return observation, reward, terminated, truncated, info

    def finish(self) -> dict[str, Any]:
        """The final `info["slam"]` of an episode that something outside of the wrapper ended.

        The wrapper sees the end of an episode, and scores it, where the environment that it wraps
        ends it, as one of `gym.make` does. It does not see a limit around itself, as in
        `TimeLimit(SlamWrapper(env), 100)`: call this after the last step, or let `FinalScores`.
        """
        self._end()
        return self._result | (self._scores(self.slam.map()) if self.scored else {})

    @property
    def scored(self) -> bool:
        """Whether the map is scored."""
        return self._score_every > 0

    def _end(self) -> None:
        """Let the SLAM process the last scan of an episode, and finish."""
        if self._waiting:
            self._update_slam()
        if isinstance(self.slam, Revising):
            self.slam.finish()
            self._revise_trail()

    def _revise_trail(self) -> None:
        """Draw the path as the SLAM believes it now."""
        self._trail = [Pose2.of(pose) for pose in believed(self.slam, np.array(self._trail))]

    def _update_slam(self) -> None:
        """Update the SLAM with the scan and the displacement since the last one."""
        estimate = self.slam.update(self._moved, self._world.scan)
        self._estimate, self._moved, self._waiting = estimate, Pose2(), False
        self._trail.append(estimate.pose)
        self._result = result_of(estimate, self._world.pose)

    def _extended(
        self, observation: Observation, info: dict[str, Any], *, scored: bool
    ) -> tuple[Observation, dict[str, Any]]:
        """The observation and info, extended by the results of the SLAM."""
        world, estimate, result = self._world, self._estimate, dict(self._result)
        if estimate.revised:
            self._revise_trail()
        if self._score_every:
            self._record_seen_surface()
        if scored:
            result |= self._scores(self.slam.map())
        if world.render_mode == "human":
            world.render()
        return self._observed(observation, estimate.pose), info | {"slam": result}

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

    # -- observation ---------------------------------------------------------------------------

    def _extended_space(self, space: spaces.Space[Any]) -> spaces.Dict:
        assert isinstance(space, spaces.Dict)
        keys = dict(space.spaces)
        if self._crop is not None:
            keys["map"] = spaces.Box(0, 255, (1, *self._crop.shape[:2]), np.uint8)
        if self._with_pose:
            high = np.array([MAX_POSITION, MAX_POSITION, np.pi], dtype=np.float32)
            keys["pose_estimate"] = spaces.Box(-high, high, dtype=np.float32)
        return spaces.Dict(keys)

    def _observed(self, observation: Observation, pose: Pose2) -> Observation:
        extra: Observation = {}
        if self._crop is not None:
            source = self._sampled or self.slam.map()
            extra["map"] = crop_map(source, pose, self._crop)[None]
        if self._with_pose:
            wrapped = math.remainder(pose.theta, math.tau)
            clipped = np.clip((pose.x, pose.y), -MAX_POSITION, MAX_POSITION)
            extra["pose_estimate"] = np.array([*clipped, wrapped], dtype=np.float32)
        return observation | extra

    def _belief(self) -> Belief | None:
        if self._slam is None:
            return None
        error = _errors(self._slam.pose, self._world.pose)
        off, turned = error["position_error"], abs(math.degrees(error["heading_error"]))
        title = f"{self._name}   off by {off:.2f} m, {turned:.1f} deg"
        return Belief(self._slam.map(), self._slam.pose, self._trail, title)


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


def crop_map(source: Sampled | OccupancyGrid, pose: Pose2, points: Array) -> NDArray[np.uint8]:
    """The map at `points` (n, n, 2), m, robot frame: 0 free, 255 occupied, 128 unknown."""
    occupied, observed = source.sample(_in_world(points.reshape(-1, 2), *pose))
    return _shades(occupied, observed).reshape(points.shape[:2])


@kernel
def _in_world(points, x, y, theta):
    """Points (n, 2) in the robot's frame, in the world."""
    c, s, result = np.cos(theta), np.sin(theta), np.empty_like(points)
    for k in range(len(points)):
        result[k, 0] = x + c * points[k, 0] - s * points[k, 1]
        result[k, 1] = y + s * points[k, 0] + c * points[k, 1]
    return result


@kernel
def _shades(occupied, observed):
    """(n,) uint8 of P(occupied), 128 where nothing was observed."""
    result = np.full(len(occupied), 128, np.uint8)
    for k in range(len(occupied)):
        if observed[k]:
            result[k] = np.uint8(min(max(occupied[k], 0.0), 1.0) * 255.0)
    return result


def crop_points(side: float, cell: float) -> Array:
    """(n, n, 2) m, centres of the cells of a crop in the robot's frame: ahead is up."""
    n = round(side / cell)
    if n < MIN_CROP:
        raise InputError(
            f"map_crop must span at least {MIN_CROP} cells of map_cell, "
            f"got {side:g} m / {cell:g} m = {n}"
        )
    along = (np.arange(n)[::-1] - (n - 1) / 2) * cell
    points = np.empty((n, n, 2))
    points[:, :, 0], points[:, :, 1] = along[:, None], along
    return points


def _builder(slam: str | Builder, seed: int) -> Any:
    if isinstance(slam, str):
        return partial(slam_library.make, slam, seed=seed)
    if not callable(slam):
        raise InputError(
            f"slam must be a builder (start, rng) -> Slam or one of "
            f"{', '.join(slam_library.variants())}, got {slam!r}"
        )
    return partial(_built, slam, seed)


def _built(slam: Builder, seed: int, start: Pose2) -> Slam:
    return slam(start, np.random.default_rng(seed))


def result_of(estimate: Estimate, truth: Pose2) -> dict[str, Any]:
    """The `info["slam"]` of an estimate, without scores; see `SlamWrapper`."""
    return _errors(estimate.pose, truth) | {
        "matched": estimate.matched,
        "revised": estimate.revised,
        "lost": estimate.lost,
    }


def _errors(estimate: Pose2, truth: Pose2) -> dict[str, Any]:
    return {
        "pose": np.array(estimate),
        "position_error": math.hypot(estimate.x - truth.x, estimate.y - truth.y),
        "heading_error": math.remainder(estimate.theta - truth.theta, math.tau),
    }
