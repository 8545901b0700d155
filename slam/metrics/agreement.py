"""Agreement of the walls that different stretches of a drive saw: a score without any truth.

Two stretches that saw the same wall draw it at one place if the poses are right. Of a building that
was driven through once, without a place seen again, it tells no more than the drift from one
stretch to the next; and doors and people lower it for every trajectory alike.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import KDTree

from slam.episode import Episode
from slam.geometry import Array, Pose2, transform_points
from slam.scan import Scan

STRETCH = 20  # scans
MIN_RANGE, MAX_RANGE = 0.1, 15.0  # m, of the echoes that count: far ones tell of the heading alone
NEAR = 0.5  # m: an echo farther from all of the other stretches is of another wall
CLOSE = 0.05  # m


def agreement(episode: Episode, poses: Array) -> float:
    """The share of the echoes within CLOSE of an echo of another stretch, among those within NEAR.

    poses  (n, 3) at each scan, in any frame

    Every second stretch is compared with the stretches between them, and the other way round. NaN
    if no echo is near to one of another stretch.
    """
    stretches: list[list[Array]] = [[np.empty((0, 2))], [np.empty((0, 2))]]
    for k, (scan, pose) in enumerate(zip(episode.scans, poses, strict=True)):
        stretches[k // STRETCH % 2].append(transform_points(Pose2.of(pose), _echoes(scan)))
    even, odd = (np.concatenate(points) for points in stretches)
    apart = np.concatenate([_distances(even, odd), _distances(odd, even)])
    near = np.count_nonzero(np.isfinite(apart))
    return np.count_nonzero(apart < CLOSE) / near if near else math.nan


def _echoes(scan: Scan) -> Array:
    """(n, 2) end points on the robot."""
    x, y, _ = scan.mount
    reach = np.hypot(*(scan.points - (x, y)).T)
    return scan.points[(reach > MIN_RANGE) & (reach < MAX_RANGE)]


def _distances(points: Array, others: Array) -> Array:
    """(n,) m from each point to the nearest of the others; infinite beyond NEAR."""
    if not len(others):
        return np.full(len(points), math.inf)
    return KDTree(others).query(points, distance_upper_bound=NEAR)[0]
