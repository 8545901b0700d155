"""Synthetic rooms and drives through them, small enough for pure Python."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from slam.episode import Episode, Truth
from slam.geometry import Pose2, between, compose
from slam.scan import Scan
from slam.trajectory import Trajectory
from tests.slam import naive

CORNERS = [(-1.52, -1.53), (2.51, -1.53), (2.51, 0.32), (3.17, 0.32), (3.17, 1.04), (2.51, 1.04),
           (2.51, 1.82), (0.33, 1.82), (0.33, 1.37), (-1.52, 1.37)]  # fmt: skip
ROOM = np.array([[*a, *b] for a, b in pairwise([*CORNERS, CORNERS[0]])])
"""A room with a niche in its east and a bulge in its north: no two places look alike."""

FAN = np.radians(np.arange(-120, 121, 2.0))
MAX_RANGE = 6.0
PAPERS_BIAS = math.radians(60.0)  # rad per m: 3 degrees per 5 cm


def scan_at(pose: Pose2, time=0.0, angles=FAN, walls=ROOM, mount=Pose2(), rng=None) -> Scan:
    """What a laser sees of the walls; with 5 mm of noise if `rng` is given."""
    ranges = naive.cast(pose @ mount, angles, walls, MAX_RANGE)
    if rng is not None:
        ranges = ranges + rng.normal(0, 0.005, len(ranges))
    return Scan(ranges, angles, MAX_RANGE, time=time, mount=mount)


def beam(length: float, time=0.0, angle=0.0, max_range=10.0) -> Scan:
    """A laser with one beam."""
    return Scan(np.array([length]), np.array([angle]), max_range, time=time)


def loop(n: int) -> np.ndarray:
    """(n, 3) poses once around an ellipse inside the room, heading along the way."""
    t = np.linspace(0, math.tau, n)
    heading = np.arctan2(0.7 * np.cos(t), -1.1 * np.sin(t))
    return np.column_stack([0.4 + 1.1 * np.cos(t), 0.7 * np.sin(t), heading])


def drive(n=150, bias=PAPERS_BIAS, angles=FAN, seed=0) -> Episode:
    """Once around the room, 10 scans a second; the odometry turns `bias` rad too far per metre."""
    rng = np.random.default_rng(seed)
    poses, times = loop(n), np.arange(n) / 10
    scans = [scan_at(Pose2.of(p), t, angles, rng=rng) for p, t in zip(poses, times, strict=True)]
    odometry = [np.zeros(3)]
    for displacement in between(poses[:-1], poses[1:]):
        wrong = (0, 0, bias * math.hypot(displacement[0], displacement[1]))
        odometry.append(compose(odometry[-1], compose(displacement, wrong)))
    truth = Truth(poses, ROOM, np.zeros((n, 0, 4)))
    return Episode(tuple(scans), Trajectory(times, np.array(odometry)), truth, {"bias": bias})


def first_scans(episode: Episode, n: int) -> Episode:
    """The first `n` scans of an episode with its truth."""
    truth = episode.truth
    assert truth is not None
    known = Truth(truth.poses[:n], truth.walls, truth.doors[:n])
    return Episode(episode.scans[:n], episode.odometry, known, episode.meta)
