"""SlamRun: a SLAM in one world, and what a robot observes of its map."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

import slam as slam_library
from dynslam_env.env import Observation
from dynslam_env.simulation.world_view import WorldView
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.interface import Builder, Estimate, Revising, Sampled, Slam, believed
from slam.kernel import kernel
from slam.validation import positive_number

MAX_POSITION = 1000.0  # m, bound of the pose estimate in the observation
MIN_CROP = 36  # cells, the smallest image of stable-baselines3's CNN


class SlamRun:
    """A SLAM in one world from the first scan of an episode on, which it takes in at the true pose.

    slam      the SLAM
    scan      the last one that it took in
    estimate  after that scan
    result    of that scan: see `result_of`
    trail     the poses that it believes now
    """

    def __init__(self, slam: Slam, view: WorldView, scan_every: int):
        """`scan_every`: the SLAM takes in every so many-th scan."""
        self.slam, self._view, self._every = slam, view, scan_every
        self.trail: list[Pose2] = []
        self.steps, self._moved = 0, Pose2()
        self._update()

    @cached_property
    def sampled(self) -> Sampled | None:
        """The SLAM, if its map can be read at some places; slow to ask."""
        return self.slam if isinstance(self.slam, Sampled) else None

    def step(self) -> None:
        """After a step of the world: take in its odometry, and its scan if it is due."""
        self.steps += 1
        self._moved = self._moved @ self._view.displacement
        self._waiting = self._view.scan_arrived
        if self._waiting and self.steps % self._every == 0:
            self._update()

    def finish(self) -> None:
        """At the end of the episode: take in the last scan, and finish."""
        if self._waiting:
            self._update()
        if isinstance(self.slam, Revising):
            self.slam.finish()
            self._believe_again()

    def _update(self) -> None:
        """Update the SLAM with the scan and the displacement since the last one."""
        self.scan = self._view.scan
        self.estimate: Estimate = self.slam.update(self._moved, self.scan)
        self._moved, self._waiting = Pose2(), False
        self.trail.append(self.estimate.pose)
        self.result = result_of(self.estimate, self._view.pose)
        if self.estimate.revised:
            self._believe_again()

    def _believe_again(self) -> None:
        self.trail = [Pose2.of(pose) for pose in believed(self.slam, np.array(self.trail))]


class SlamView(NamedTuple):
    """What the observation has of a SLAM beside the sensors.

    crop       see `crop_points`; None: no map
    with_pose  whether it has the estimated pose
    """

    crop: Array | None
    with_pose: bool

    @staticmethod
    def of(map_crop: float | None, map_cell: float, pose_estimate: bool) -> SlamView:
        """From the arguments of `SlamWrapper`; raises InputError for wrong ones."""
        positive_number("map_cell", map_cell)
        if map_crop is None:
            return SlamView(None, pose_estimate)
        positive_number("map_crop", map_crop)
        return SlamView(crop_points(map_crop, map_cell), pose_estimate)

    def spaces(self) -> dict[str, spaces.Space[Any]]:
        """The spaces of what is added, by key."""
        keys: dict[str, spaces.Space[Any]] = {}
        if self.crop is not None:
            keys["map"] = spaces.Box(0, 255, (1, *self.crop.shape[:2]), np.uint8)
        if self.with_pose:
            high = np.array([MAX_POSITION, MAX_POSITION, np.pi], dtype=np.float32)
            keys["pose_estimate"] = spaces.Box(-high, high, dtype=np.float32)
        return keys

    def observation(self, run: SlamRun) -> Observation:
        """What is added, by key."""
        extra, pose = {}, run.estimate.pose
        if self.crop is not None:
            extra["map"] = crop_map(run.sampled or run.slam.map(), pose, self.crop)[None]
        if self.with_pose:
            wrapped = math.remainder(pose.theta, math.tau)
            clipped = np.clip((pose.x, pose.y), -MAX_POSITION, MAX_POSITION)
            extra["pose_estimate"] = np.array([*clipped, wrapped], dtype=np.float32)
        return extra


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


def builder_of(slam: str | Builder, seed: int) -> Callable[[Pose2], Slam]:
    """Makes the SLAM of an episode that begins at a pose; raises InputError for an unknown one."""
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
    return errors_of(estimate.pose, truth) | {
        "matched": estimate.matched,
        "revised": estimate.revised,
        "lost": estimate.lost,
        "drift": estimate.drift,
    }


def errors_of(estimate: Pose2, truth: Pose2) -> dict[str, Any]:
    """The estimated pose and its errors."""
    return {
        "pose": np.array(estimate),
        "position_error": math.hypot(estimate.x - truth.x, estimate.y - truth.y),
        "heading_error": math.remainder(estimate.theta - truth.theta, math.tau),
    }
