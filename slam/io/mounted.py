"""Where the laser stands on the robot, for formats that tell it once."""

from __future__ import annotations

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2, wrap_angle

STILL = 1e-3  # m and rad: CARMEN tells it by two poses, rounded, in every line anew


def only_mount(episode: Episode) -> Pose2:
    """That of all scans. Raises InputError for a laser that moves on the robot."""
    mount = episode.scans[0].mount
    moved = np.array([scan.mount for scan in episode.scans]) - mount
    moved[:, 2] = wrap_angle(moved[:, 2])
    if np.abs(moved).max() > STILL:
        raise InputError("this format needs a laser that stays where it is on the robot")
    return mount
