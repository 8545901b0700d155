"""The protocols: what a SLAM is, and the four parts that a maximum likelihood SLAM is made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from slam.geometry import Array, Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.maps.centroids import Centroids
from slam.scan import Scan


class Estimate(NamedTuple):
    """What a SLAM believes after an update.

    pose        the robot in the world
    covariance  (3, 3) of x, y in m and theta in rad, in the world
    score       mean log-likelihood per beam of the last matched scan; 0 before
    matched     whether the pose was found from this scan, rather than by dead reckoning alone
    """

    pose: Pose2
    covariance: Array
    score: float
    matched: bool


class Slam(Protocol):
    """Anything that turns odometry and scans into a pose and a map. One object an episode."""

    pose: Pose2

    def update(self, motion: Pose2, scan: Scan) -> Estimate:
        """Take in the odometry's displacement since the last update, in the robot's frame, then the
        scan."""
        ...

    def map(self) -> OccupancyGrid:
        """The map as it is believed now: a copy, which later updates leave alone."""
        ...


class MapModel(Protocol):
    """One way to remember what the cells have been. `occupied` is h, P(occupied now)."""

    spec: GridSpec
    prior: float
    occupied: np.ndarray
    observed: np.ndarray
    centroids: Centroids

    def integrate(self, scan: Scan, pose: Pose2) -> np.ndarray:
        """Put a scan taken at `pose` into the map, which grows to hold it.

        Gives the cells that changed, as flat indices.
        """
        ...


Objective = Callable[[Array], Array]
"""Poses (n, 3) -> log posterior of each (n,): the product of equation 7 in the log domain."""


class Perception(Protocol):
    """One reading of log p(scan | pose, h)."""

    def refresh(self, grid: MapModel, changed: np.ndarray) -> None:
        """Take notice that `changed` cells of the map have a new h."""
        ...

    def log_likelihood(self, scan: Scan, poses: Array) -> Array:
        """(n,) log p(scan | pose, h) of each of the poses (n, 3)."""
        ...


class Motion(Protocol):
    """p(s | u, s'): where the robot may be after the odometry said `motion`."""

    def deviations(self, motion: Pose2) -> Array:
        """(3,) standard deviations of the error of `motion`, in the frame that it leads to."""
        ...


class Search(Protocol):
    """The argmax of equation 7."""

    def __call__(
        self, objective: Objective, start: Pose2, deviations: Array, rng: np.random.Generator
    ) -> Pose2:
        """The pose of the largest `objective` near `start`.

        deviations  (3,) how far off `start` is likely to be, in its own frame: m, m, rad
        """
        ...


Builder = Callable[[Pose2, np.random.Generator], Slam]
"""Makes a new SLAM: (start pose in the world, randomness) -> Slam."""
