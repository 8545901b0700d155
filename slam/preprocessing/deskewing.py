"""A laser takes its readings one after the other while the robot drives on."""

from __future__ import annotations

import dataclasses

import numpy as np

from slam.episode import Episode
from slam.geometry import between, compose
from slam.scan import Scan
from slam.trajectory import Trajectory

LONGEST = 1.0  # s: no sweep takes longer; a recording that says so is wrong
NOTICED = 1e-3  # m and rad: less motion during a sweep is left as it is


def standing(episode: Episode) -> Episode:
    """The episode as if every scan's beams had all been measured at its stamp, that of the first
    beam: each is moved by what the odometry says that the robot did since then."""
    if not (episode.has_odometry and any(scan.beam_time for scan in episode.scans)):
        return episode
    scans = tuple(_standing(scan, episode.odometry) for scan in episode.scans)
    return dataclasses.replace(episode, scans=scans)


def _standing(scan: Scan, odometry: Trajectory) -> Scan:
    if not 0 < scan.beam_time * len(scan.ranges) <= LONGEST:
        return scan
    times = scan.time + scan.beam_time * np.arange(len(scan.ranges), dtype=np.float64)
    poses, mount = odometry.at(times), np.array(scan.mount)
    moved = between(mount, compose(between(poses[0], poses), mount))
    if np.abs(moved).max() < NOTICED:
        return scan
    angles = scan.angles + moved[:, 2]
    seen = scan.hit
    along = np.where(seen, scan.ranges, 0.0)
    x, y = moved[:, 0] + along * np.cos(angles), moved[:, 1] + along * np.sin(angles)
    return dataclasses.replace(
        scan,
        ranges=np.where(seen, np.hypot(x, y), scan.ranges),
        angles=np.where(seen, np.arctan2(y, x), angles),
        beam_time=0.0,
    )
