"""Trajectories in the TUM RGB-D format: `timestamp x y z qx qy qz qw`, s and m, one pose a line."""

from __future__ import annotations

import numpy as np

from slam.errors import InputError
from slam.io.files import AnyPath, replacing
from slam.io.guard import guarded
from slam.io.number_columns import read_columns
from slam.trajectory import Trajectory

COLUMNS = "timestamp x y z qx qy qz qw"


def write_tum(trajectory: Trajectory, path: AnyPath) -> None:
    """Write a planar trajectory (z = 0). Stamps keep every bit: at least six decimals."""
    with replacing(path) as file:
        file.write(f"# {COLUMNS}\n".encode())
        half = trajectory.poses[:, 2] / 2
        for time, (x, y, _), qz, qw in zip(
            trajectory.times, trajectory.poses, np.sin(half), np.cos(half), strict=True
        ):
            stamp = np.format_float_positional(time, unique=True, min_digits=6)
            file.write(f"{stamp} {x:.9f} {y:.9f} 0 0 0 {qz:.12f} {qw:.12f}\n".encode())


def read_tum(path: AnyPath) -> Trajectory:
    """Read a trajectory seen from above: no z, and the yaw as heading. Raises InputError."""
    with guarded(path):
        return _read(path)


def _read(path: AnyPath) -> Trajectory:
    rows, numbers = read_columns(path, COLUMNS)
    if not len(rows):
        raise InputError(f"{path}: no pose in it, expected lines of `{COLUMNS}`")
    late = np.flatnonzero(np.diff(rows[:, 0]) <= 0)
    if len(late):
        raise InputError(
            f"{path}:{numbers[late[0] + 1]}: expected a later timestamp than before it"
        )
    with np.errstate(over="ignore"):
        norm = np.sqrt((rows[:, 4:] ** 2).sum(axis=1))
    wrong = np.flatnonzero(np.abs(norm - 1) > 0.01)
    if len(wrong):
        raise InputError(f"{path}:{numbers[wrong[0]]}: expected a unit quaternion qx qy qz qw")
    qx, qy, qz, qw = (rows[:, 4:] / norm[:, None]).T
    yaw = np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
    return Trajectory(rows[:, 0].copy(), np.column_stack([rows[:, 1], rows[:, 2], yaw]))
