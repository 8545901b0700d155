"""Covariances of relative poses, each in the frame of the pose whose error it is."""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel

LEVER = 5.0  # m by which an error of the heading, rad, is compared with one of the position
MIN_INFORMATION = np.array([1e-4, 1e-4, 1e-2])  # 1/m^2, 1/m^2, 1/rad^2: bounds the covariance


@kernel
def size(P):
    """One number, m^2, for a covariance of (x, y, theta), by which two are compared."""
    return P[0, 0] + P[1, 1] + LEVER * LEVER * P[2, 2]


@kernel
def carried(P, move):
    """The covariance of a pose that lies `move` (3,) beyond the one of covariance P."""
    c, s = np.cos(move[2]), np.sin(move[2])
    x, y = move[0], move[1]
    return _congruent(c, s, s * x - c * y, c * x + s * y, P)


@kernel
def carried_back(P, move):
    """The covariance of the pose beyond which the one of covariance P lies by `move` (3,)."""
    return _congruent(np.cos(move[2]), -np.sin(move[2]), move[1], -move[0], P)


@kernel
def _congruent(c, s, u, v, P):
    """J P J' with J = [[c, s, u], [-s, c, v], [0, 0, 1]]."""
    half, result = np.empty((3, 3)), np.empty((3, 3))
    for k in range(3):
        half[0, k] = c * P[0, k] + s * P[1, k] + u * P[2, k]
        half[1, k] = -s * P[0, k] + c * P[1, k] + v * P[2, k]
        half[2, k] = P[2, k]
    for k in range(3):
        result[k, 0] = c * half[k, 0] + s * half[k, 1] + u * half[k, 2]
        result[k, 1] = -s * half[k, 0] + c * half[k, 1] + v * half[k, 2]
        result[k, 2] = half[k, 2]
    return result


@kernel
def covariance_of(information):
    """The inverse of a symmetric (3, 3) matrix plus MIN_INFORMATION, by Cramer's rule."""
    a, b, c = (
        information[0, 0] + MIN_INFORMATION[0],
        information[1, 1] + MIN_INFORMATION[1],
        information[2, 2] + MIN_INFORMATION[2],
    )
    f, h, k = information[0, 1], information[0, 2], information[1, 2]
    result = np.empty((3, 3))
    result[0, 0], result[1, 1], result[2, 2] = b * c - k * k, a * c - h * h, a * b - f * f
    result[0, 1] = result[1, 0] = k * h - f * c
    result[0, 2] = result[2, 0] = f * k - b * h
    result[1, 2] = result[2, 1] = f * h - a * k
    return result / (a * result[0, 0] + f * result[0, 1] + h * result[0, 2])
