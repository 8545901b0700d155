"""Trajectories in KITTI's format: the upper 3 x 4 of each pose's matrix, row by row, on a line.

The axes are ours, as evo, ROS and KITTI's velodyne have them: x ahead, y left, z up. (The poses
that KITTI publishes are a camera's: x right, y down, z ahead.)
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from slam.errors import InputError
from slam.geometry import Array
from slam.io.files import AnyPath, replacing
from slam.io.number_columns import read_columns
from slam.trajectory import Trajectory

COLUMNS = "r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z"
MIN_UPRIGHT = math.cos(math.radians(10.0))  # cosine of the tilt of a robot on a floor
ROTATION_TOLERANCE = 0.01  # of the elements of R R^T


def write_kitti(trajectory: Trajectory, path: AnyPath) -> Path:
    """Write a planar trajectory (z = 0); returns the path of the file of stamps beside it.

    The format has no stamps: as in KITTI's times.txt they are a file of their own, s, one a line:
    `poses-times.txt` beside `poses.txt`. Raises InputError if they cannot be written.
    """
    x, y, theta = trajectory.poses.T
    c, s = np.cos(theta), np.sin(theta)
    zero, one = np.zeros(len(trajectory)), np.ones(len(trajectory))
    rows = np.column_stack([c, -s, zero, x, s, c, zero, y, zero, zero, one, zero])
    with replacing(path) as file:
        np.savetxt(file, rows, fmt="%.12g")
    times = Path(path).with_name(f"{Path(path).stem}-times.txt")
    with replacing(times) as file:
        for time in trajectory.times:
            file.write(f"{np.format_float_positional(time, unique=True, min_digits=6)}\n".encode())
    return times


def read_kitti(path: AnyPath) -> Array:
    """(n, 3) poses seen from above: no z, and the heading of the x axis. Raises InputError that
    names the line, where it is no pose or its z axis does not point up, as a camera's does not."""
    rows, numbers = read_columns(path, COLUMNS)
    if not len(rows):
        raise InputError(f"{path}: no pose in it, expected lines of `{COLUMNS}`")
    turns = rows.reshape(-1, 3, 4)[:, :, :3]
    off = np.abs(turns @ np.swapaxes(turns, 1, 2) - np.eye(3)).max(axis=(1, 2))
    wrong = np.flatnonzero((off > ROTATION_TOLERANCE) | (np.linalg.det(turns) < 0))
    if len(wrong):
        raise InputError(f"{path}:{numbers[wrong[0]]}: expected a pose, got no rotation")
    tilted = np.flatnonzero(turns[:, 2, 2] < MIN_UPRIGHT)
    if len(tilted):
        raise InputError(
            f"{path}:{numbers[tilted[0]]}: expected x ahead, y left and z up, but z is tilted; are "
            f"these the axes of a camera?"
        )
    return np.column_stack([rows[:, 3], rows[:, 7], np.arctan2(turns[:, 1, 0], turns[:, 0, 0])])
