"""The pose of the laser on the robot, for formats that have one for all scans."""

from __future__ import annotations

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2, wrap_angle

MOUNT_TOLERANCE = 1e-3  # m and rad: CARMEN gives it by two rounded poses in every line


def constant_mount(episode: Episode) -> Pose2:
    """The mount of all scans. Raises InputError for a laser that moves on the robot."""
    mount = episode.scans[0].mount
    moved = np.array([scan.mount for scan in episode.scans]) - mount
    moved[:, 2] = wrap_angle(moved[:, 2])
    if np.abs(moved).max() > MOUNT_TOLERANCE:
        raise InputError("this format needs a laser that stays where it is on the robot")
    return mount
