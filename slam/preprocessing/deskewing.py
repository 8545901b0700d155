"""Deskewing: corrects scans for the motion of the robot during the sweep."""

from __future__ import annotations

import dataclasses

import numpy as np

from slam.episode import Episode
from slam.geometry import between, compose
from slam.scan import Scan
from slam.trajectory import Trajectory

MAX_SWEEP = 1.0  # s; a recording with longer sweeps is wrong, and is left unchanged
MIN_MOTION = 1e-3  # m and rad during a sweep; below it a scan is left unchanged


def deskewed(episode: Episode) -> Episode:
    """The episode with all beams of every scan as if measured at the time of the first beam, by the
    odometry."""
    if not (episode.has_odometry and any(scan.beam_time for scan in episode.scans)):
        return episode
    scans = tuple(_deskewed(scan, episode.odometry) for scan in episode.scans)
    return dataclasses.replace(episode, scans=scans)


def _deskewed(scan: Scan, odometry: Trajectory) -> Scan:
    if not 0 < scan.beam_time * len(scan.ranges) <= MAX_SWEEP:
        return scan
    times = scan.time + scan.beam_time * np.arange(len(scan.ranges), dtype=np.float64)
    poses, mount = odometry.at(times), np.array(scan.mount)
    moved = between(mount, compose(between(poses[0], poses), mount))
    if np.abs(moved).max() < MIN_MOTION:
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
