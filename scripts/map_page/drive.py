"""The drive for the script of the page: poses, being lost, and the echoes of some scans."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from slam.episode import Episode
from slam.geometry import Array

MAX_POSES, MAX_MOMENTS, MAX_ECHOES = 20_000, 600, 90  # of the drive, shown, of a moment
METRE = 100  # units of an echo's coordinates in a metre
FURTHEST = 32_000 / METRE  # m, of an echo


def drive(episode: Episode, poses: Array, lost: Array) -> dict[str, Any]:
    """The drive as numbers in base64, little endian.

    poses  (n, 3) as estimated at the end
    lost   (n,) probability of being lost, at the scans

    `times` (s from the first scan), `poses` (x, y, theta) float32; `lost` in percent, uint8;
    `moments` uint32: the numbers of those poses whose echoes are held; `counts` uint16 of their
    echoes; `echoes` int16: x and y in cm in the robot's frame.
    """
    kept = _chosen(len(poses), MAX_POSES)
    moments = _chosen(len(kept), MAX_MOMENTS)
    shown = [_echoes(episode.scans[number].points) for number in kept[moments].tolist()]
    times = episode.times[kept] - episode.times[0]
    return {
        "times": _packed(times, "<f4"),
        "poses": _packed(poses[kept], "<f4"),
        "lost": _packed(np.rint(100 * lost[kept]), "u1"),
        "moments": _packed(moments, "<u4"),
        "counts": _packed(np.array([len(one) for one in shown]), "<u2"),
        "echoes": _packed(np.concatenate(shown), "<i2"),
    }


def _chosen(count: int, most: int) -> np.ndarray:
    """`most` numbers below `count`, evenly spread, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(int))


def _echoes(points: Array) -> np.ndarray:
    """(n, 2) int16 coordinates of at most MAX_ECHOES echoes, in units."""
    points = points[:: -(-max(len(points), 1) // MAX_ECHOES)]
    near = (np.abs(points) < FURTHEST).all(axis=1)
    return np.rint(METRE * points[near]).astype(np.int16)


def _packed(values: Array, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
