"""The protocols of a SLAM, and of the four parts of a maximum likelihood SLAM."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.maps.cells import Cells
from slam.metrics.lost import LOST_DISTANCE as LOST_DISTANCE
from slam.metrics.lost import LOST_TURN as LOST_TURN
from slam.motion.gaussian import Prediction
from slam.scan import Scan


class Estimate(NamedTuple):
    """The estimate of a SLAM after an update.

    pose        the robot in the world
    covariance  (3, 3) of x, y in m and theta in rad, in the world
    score       mean log-likelihood per beam of the last matched scan; 0 before
    matched     whether this scan was matched; otherwise the pose is dead reckoned
    revised     whether estimates of earlier poses have changed: see `believed`
    lost        probability that the pose, within its map, is off by more than LOST_DISTANCE or
                LOST_TURN; 0 from a SLAM that does not judge it
    drift       m, by which the pose was moved at this scan, from where a drift had led it to where
                the last metres fit what was mapped long before; 0 where it was not
    """

    pose: Pose2
    covariance: Array
    score: float
    matched: bool
    revised: bool = False
    lost: float = 0.0
    drift: float = 0.0


class Slam(Protocol):
    """A SLAM: estimates the pose and a map from odometry and scans. One object an episode."""

    pose: Pose2

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Process the odometry's displacement since the last update, in the robot's frame, then the
        scan."""
        ...

    def map(self) -> OccupancyGrid:
        """The current map: a copy, which later updates do not change."""
        ...


@runtime_checkable
class Sampled(Slam, Protocol):
    """A SLAM whose map can be read at some places without a copy of all of it."""

    def sample(self, points: Array) -> tuple[Array, np.ndarray]:
        """(n,) h of the cells that hold points (n, 2), m, world, and whether they were observed."""
        ...


@runtime_checkable
class Revising(Slam, Protocol):
    """A SLAM that may revise earlier poses, as when a loop closes."""

    def trajectory(self) -> Array:
        """(n, 3) the current estimate of the pose of every update so far: the smoothed trajectory,
        as opposed to the online one of the estimates that `update` returned."""
        ...

    def finish(self) -> None:
        """Complete pending work after the last scan."""
        ...


@runtime_checkable
class Restarting(Slam, Protocol):
    """A SLAM that may go through its first scans a second time, with what they showed."""

    @property
    def first_poses(self) -> Array:
        """(n, 3) poses of the first n updates, as they were found the second time; (0, 3) before.
        The map holds the scans at these poses from the n-th update on."""
        ...


def believed(slam: Slam, online: Array) -> Array:
    """(n, 3) the poses of the updates so far, as `slam` believes now, where `online` (n, 3) are
    those that the updates returned."""
    if isinstance(slam, Revising):
        return slam.trajectory()
    if isinstance(slam, Restarting) and len(slam.first_poses):
        return np.concatenate([slam.first_poses, online[len(slam.first_poses) :]])
    return online


class MapModel(Protocol):
    """A map model: what is stored of the history of every cell, and its occupancy h."""

    cells: Cells

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Integrate a scan taken at `pose` into the map, which grows as needed.

        Returns the ids of all cells whose h or centroid may have changed.
        """
        ...


class Slope(NamedTuple):
    """Second-order expansion of a function at a pose.

    value      at the pose
    gradient   (3,) by x, y in m and theta in rad, world
    curvature  (3, 3), negative semi-definite: the Hessian, or its negative part
    """

    value: float
    gradient: Array
    curvature: Array


class SensorModel(Protocol):
    """A sensor model: log p(scan | pose, h).

    levels     number of resolutions it can be evaluated at; 0 is the finest, the model itself
    sharpness  by how much the information of a match exceeds the curvature of the log-likelihood:
               chosen such that errors in the built-in worlds are as large as claimed
    """

    levels: int
    sharpness: float

    def refresh(self, map_model: MapModel, changed: np.ndarray) -> None:
        """Update cached fields for the `changed` cells (ids) of the map."""
        ...

    def log_likelihood(self, scan: Scan, poses: Array, floor: float = -math.inf) -> Array:
        """(n,) log p(scan | pose, h) of each of the poses (n, 3).

        May return -inf below `floor`.
        """
        ...

    def slope(self, scan: Scan, pose: Pose2, level: int = 0) -> Slope:
        """The log-likelihood around a pose, at one of the resolutions, in new arrays."""
        ...


class Posterior:
    """log p(z | s, h) + log p(s | u, s') of poses s, up to a constant: the search objective."""

    def __init__(self, sensor_model: SensorModel, scan: Scan, prediction: Prediction):
        self.sensor_model = sensor_model
        self.scan = scan
        self.prediction = prediction

    def __call__(self, poses: Array, floor: float = -math.inf) -> Array:
        """(n,) at each of the poses (n, 3); may be -inf below `floor`."""
        likelihood = self.sensor_model.log_likelihood(
            self.scan, poses, floor
        )  # no prior is above 0
        return likelihood + self.prediction.log_density(poses)

    def slope(self, pose: Pose2, level: int = 0) -> Slope:
        """Value, gradient and curvature, with the likelihood at one of the resolutions."""
        value, gradient, curvature = self.sensor_model.slope(self.scan, pose, level)
        value += self.prediction.add_slope(pose, gradient, curvature)
        return Slope(value, gradient, curvature)


class MotionModel(Protocol):
    """The motion model p(s | u, s'): corrects an odometry displacement, and models its error."""

    def corrected(self, displacement: Pose2) -> Pose2:
        """The expected displacement where the odometry measured `displacement`."""
        ...

    def deviations(self, displacement: Pose2) -> Array:
        """(3,) standard deviations of its error, in the frame of the pose after it."""
        ...

    def learn(self, displacement: Pose2, found: Pose2, covariance: Array) -> None:
        """Learn from a match: the robot moved `found`, with (3, 3) `covariance` in the frame of the
        pose before, where the odometry measured `displacement`."""
        ...


class Search(Protocol):
    """A search for the argmax of equation 7."""

    def __call__(self, posterior: Posterior, rng: np.random.Generator) -> Pose2:
        """The pose that maximises `posterior` near the pose that the odometry predicts."""
        ...


Builder = Callable[[Pose2, np.random.Generator], Slam]
"""Makes a new SLAM: (start pose in the world, random generator) -> Slam."""
