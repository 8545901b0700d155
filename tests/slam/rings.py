"""Corridors around a block, and drives through them that come back to where they began."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

import numpy as np

from slam.episode import Episode, Truth
from slam.geometry import Pose2, between, compose
from slam.scan import Scan
from slam.trajectory import Trajectory
from tests.slam import naive

OUTER = [(-1.0, -1.0), (3.0, -1.0), (3.0, -1.4), (3.8, -1.4), (3.8, -1.0), (7.0, -1.0), (7.0, 3.0),
         (7.5, 3.0), (7.5, 4.0), (7.0, 4.0), (7.0, 6.0), (4.0, 6.0), (4.0, 6.6), (2.5, 6.6),
         (2.5, 6.0), (-1.0, 6.0), (-1.0, 2.5), (-1.3, 2.5), (-1.3, 1.9), (-1.0, 1.9)]  # fmt: skip
INNER = [(1.0, 1.0), (5.0, 1.0), (5.0, 2.0), (4.6, 2.0), (4.6, 2.7), (5.0, 2.7), (5.0, 4.0),
         (2.0, 4.0), (2.0, 3.6), (1.5, 3.6), (1.5, 4.0), (1.0, 4.0)]  # fmt: skip
WALLS = np.array(
    [[*a, *b] for corners in (OUTER, INNER) for a, b in pairwise([*corners, corners[0]])]
)
MIDDLE = np.array([(0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0)])
ANGLES = np.radians(np.arange(-90, 91, 5.0))
BIAS = math.radians(10.0)  # rad per m


def way(laps: float, step=0.1) -> np.ndarray:
    """(n, 3) poses along the middle of the corridors, a scan each `step` m and 22.5 degrees."""
    poses, sides = [], round(4 * laps)
    for k in range(sides):
        a, b = MIDDLE[k % 4], MIDDLE[(k + 1) % 4]
        heading, n = k * math.pi / 2, round(float(np.hypot(*(b - a))) / step)
        poses += [(*(a + (b - a) * i / n), heading) for i in range(n)]
        poses += [(*b, heading + i * math.pi / 8) for i in range(1, 4)]
    return compose(np.array(poses), (0.0, 0.0, 0.0))


@cache
def drive(laps=2.0, reach=2.5, bias=BIAS, seed=0) -> Episode:
    """Around the block, 5 scans a second; the odometry turns `bias` rad too far per metre.

    The laser sees no farther than `reach` m: in the corridors, the sides alone.
    """
    rng, poses = np.random.default_rng(seed), way(laps)
    times, odometry = np.arange(len(poses)) / 5, [poses[0]]
    for displacement in between(poses[:-1], poses[1:]):
        driven = math.hypot(displacement[0], displacement[1])
        wrong = (rng.normal(0, 0.02) * driven, 0.0, bias * driven)
        odometry.append(compose(odometry[-1], compose(displacement, wrong)))
    scans = []
    for pose, time in zip(poses, times, strict=True):
        ranges = naive.cast(Pose2.of(pose), ANGLES, WALLS, reach)
        ranges = ranges + rng.normal(0, 0.01, len(ranges))
        scans.append(Scan(ranges, ANGLES, reach, time=float(time)))
    truth = Truth(poses, WALLS, np.zeros((len(poses), 0, 4)))
    return Episode(tuple(scans), Trajectory(times, np.array(odometry)), truth, {"bias": bias})


def off(poses, episode: Episode) -> np.ndarray:
    """(n,) m from the truth."""
    assert episode.truth is not None
    return np.hypot(*(np.asarray(poses) - episode.truth.poses)[:, :2].T)
