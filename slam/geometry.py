"""Poses in the plane, SE(2): compose, inverse, between, and the same for arrays of poses."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slam.kernel import kernel

Array = NDArray[np.float64]


class Pose2(NamedTuple):
    """A pose in the plane, or the corresponding transform: x, y in m, theta in rad.

    `world_from_robot @ robot_from_sensor` composes two of them.
    """

    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0

    def __matmul__(self, other: Pose2) -> Pose2:
        x, y, theta = self
        dx, dy, turn = other
        c, s = math.cos(theta), math.sin(theta)
        return Pose2(
            x + c * dx - s * dy, y + s * dx + c * dy, math.remainder(theta + turn, math.tau)
        )

    def inverse(self) -> Pose2:
        """The inverse transform: `pose @ pose.inverse()` is the identity."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return Pose2(-c * self.x - s * self.y, s * self.x - c * self.y, -self.theta)

    def between(self, other: Pose2) -> Pose2:
        """`other` relative to this pose: `self @ self.between(other) == other`."""
        x, y, theta = self
        dx, dy, turn = other
        c, s = math.cos(theta), math.sin(theta)
        return Pose2(
            -c * x - s * y + c * dx + s * dy,
            s * x - c * y - s * dx + c * dy,
            math.remainder(turn - theta, math.tau),
        )

    @staticmethod
    def of(values: ArrayLike) -> Pose2:
        """Make a pose from three numbers (x, y, theta)."""
        x, y, theta = np.asarray(values, dtype=np.float64).tolist()
        return Pose2(x, y, theta)


def near(one: Pose2, other: Pose2, distance: float, turn: float) -> bool:
    """Whether two poses are at most `distance`, m, and `turn`, rad, apart."""
    apart = abs(math.remainder(other.theta - one.theta, math.tau))
    return apart <= turn and math.dist(one[:2], other[:2]) <= distance


def wrap_angle(angle: ArrayLike) -> Array:
    """Angles wrapped to [-pi, pi), rad, any shape."""
    return (np.asarray(angle, dtype=np.float64) + np.pi) % (2 * np.pi) - np.pi


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """`a @ b` over arrays of poses, shapes (..., 3), broadcast against each other."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack(
        [
            a[..., 0] + c * b[..., 0] - s * b[..., 1],
            a[..., 1] + s * b[..., 0] + c * b[..., 1],
            wrap_angle(a[..., 2] + b[..., 2]),
        ],
        axis=-1,
    )


def inverse(a: ArrayLike) -> Array:
    """The inverse of every pose of an array (..., 3)."""
    a = np.asarray(a, dtype=np.float64)
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack(
        [-c * a[..., 0] - s * a[..., 1], s * a[..., 0] - c * a[..., 1], wrap_angle(-a[..., 2])],
        axis=-1,
    )


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """Poses `b` relative to poses `a`, shapes (..., 3)."""
    return compose(inverse(a), b)


def transform_points(pose: Pose2, points: ArrayLike) -> Array:
    """Points (..., 2), m, given in the frame of `pose`, expressed in its parent frame."""
    points = np.asarray(points, dtype=np.float64)
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    return points @ np.array([[c, s], [-s, c]]) + (pose.x, pose.y)


@kernel
def lever_jacobian(x, y):
    """(3, 3) Jacobian of a pose, fixed at (x, y) m from a frame's origin, by the frame's pose.

    World axes: a heading error of the frame, rad, moves the pose by (-y, x) m per rad.
    """
    J = np.eye(3)
    J[0, 2], J[1, 2] = -y, x
    return J


def turned(theta: float) -> Array:
    """(3, 3) rotation by theta (rad) of (x, y, theta): from a frame's axes to its parent's."""
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
