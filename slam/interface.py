"""The protocols: what a SLAM is, and the four parts that a maximum likelihood SLAM is made of."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.maps.cells import Cells
from slam.motion.gaussian import Prediction
from slam.scan import Scan


class Estimate(NamedTuple):
    """The estimate of a SLAM after an update.

    pose        the robot in the world
    covariance  (3, 3) of x, y in m and theta in rad, in the world
    score       mean log-likelihood per beam of the last matched scan; 0 before
    matched     whether the pose was found from this scan, rather than by dead reckoning alone
    revised     whether earlier poses are believed to have been others than was said then
    """

    pose: Pose2
    covariance: Array
    score: float
    matched: bool
    revised: bool = False


class Slam(Protocol):
    """Anything that turns odometry and scans into a pose and a map. One object an episode."""

    pose: Pose2

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        """Take in the odometry's displacement since the last update, in the robot's frame, then the
        scan."""
        ...

    def map(self) -> OccupancyGrid:
        """The map as it is believed now: a copy, which later updates leave alone."""
        ...


@runtime_checkable
class Revising(Slam, Protocol):
    """A SLAM that may revise earlier poses, as when a loop closes."""

    def trajectory(self) -> Array:
        """(n, 3) the pose of every update so far, as believed now: the smoothed trajectory, beside
        the online one, which the estimates made at their time."""
        ...

    def finish(self) -> None:
        """Complete pending work after the last scan."""
        ...


class MapModel(Protocol):
    """A map model: the memory of what the cells have been."""

    cells: Cells

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Put a scan taken at `pose` into the map, which grows to hold it.

        Gives the ids of all cells whose h or centroid may have changed.
        """
        ...


class Slope(NamedTuple):
    """A function around a pose.

    value      at the pose
    gradient   (3,) by x, y in m and theta in rad, world
    curvature  (3, 3), nowhere positive: the Hessian, or what of it bends down
    """

    value: float
    gradient: Array
    curvature: Array


class SensorModel(Protocol):
    """A sensor model: log p(scan | pose, h).

    levels  how many resolutions it can be evaluated at; 0 is the finest, the model itself
    """

    levels: int

    def refresh(self, map_model: MapModel, changed: np.ndarray) -> None:
        """Update cached fields for the `changed` cells (ids) of the map."""
        ...

    def log_likelihood(self, scan: Scan, poses: Array, floor: float = -math.inf) -> Array:
        """(n,) log p(scan | pose, h) of each of the poses (n, 3).

        May return -inf below `floor`.
        """
        ...

    def bound(self, scan: Scan, poses: Array, reach: float) -> Array:
        """(n,) no less than the log-likelihood at any pose within `reach` m, in x and in y, of each
        of the poses (n, 3), with the same heading. Infinity where nothing better is known."""
        ...

    def slope(self, scan: Scan, pose: Pose2, level: int = 0) -> Slope:
        """The log-likelihood around a pose, at one of the resolutions."""
        ...


class Posterior:
    """log p(z | s, h) + log p(s | u, s') of poses s, up to a constant: what a search climbs."""

    def __init__(self, sensor_model: SensorModel, scan: Scan, prediction: Prediction):
        self.sensor_model = sensor_model
        self.scan = scan
        self.prediction = prediction

    def __call__(self, poses: Array, floor: float = -math.inf) -> Array:
        """(n,) at each of the poses (n, 3); maybe -inf where it is below `floor`."""
        likelihood = self.sensor_model.log_likelihood(
            self.scan, poses, floor
        )  # no prior is above 0
        return likelihood + self.prediction.log_density(poses)

    def slope(self, pose: Pose2, level: int = 0) -> Slope:
        """Value, gradient and curvature, with the scan read at one of the resolutions."""
        scan = self.sensor_model.slope(self.scan, pose, level)
        value, gradient, curvature = self.prediction.slope(pose)
        return Slope(scan.value + value, scan.gradient + gradient, scan.curvature + curvature)


class MotionModel(Protocol):
    """The motion model p(s | u, s'): a displacement by the odometry, and its error."""

    def corrected(self, displacement: Pose2) -> Pose2:
        """The expected displacement where the odometry measured `displacement`."""
        ...

    def deviations(self, displacement: Pose2) -> Array:
        """(3,) standard deviations of its error, in the frame of the pose that it leads to."""
        ...

    def learn(self, displacement: Pose2, found: Pose2, covariance: Array) -> None:
        """Learn from a match: the robot moved `found`, with (3, 3) `covariance`, where the odometry
        measured `displacement`."""
        ...


class Search(Protocol):
    """The argmax of equation 7."""

    def __call__(self, posterior: Posterior, rng: np.random.Generator) -> Pose2:
        """The pose of the largest `posterior` near the one that the odometry predicts."""
        ...


Builder = Callable[[Pose2, np.random.Generator], Slam]
"""Makes a new SLAM: (start pose in the world, randomness) -> Slam."""
