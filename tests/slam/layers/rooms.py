"""Simulated scans by brute force: every beam against every segment."""

import numpy as np

from slam.geometry import Array, Pose2
from slam.scan import Scan

ANGLES = np.radians(np.arange(-180.0, 180.0, 1.0))
HZ = 10.0


def scan(segments: Array, pose: Pose2, time: float, max_range: float = 8.0) -> Scan:
    """A scan of segments (w, 4), m, at `pose`."""
    origin = np.array(pose[:2])
    beams = np.stack([np.cos(ANGLES + pose.theta), np.sin(ANGLES + pose.theta)], axis=1)
    ranges = np.full(len(ANGLES), np.inf)
    for x1, y1, x2, y2 in segments:
        along = np.array([x2 - x1, y2 - y1])
        away = np.array([x1, y1]) - origin
        cross = beams[:, 0] * along[1] - beams[:, 1] * along[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            far = (away[0] * along[1] - away[1] * along[0]) / cross
            part = (away[0] * beams[:, 1] - away[1] * beams[:, 0]) / cross
        hit = (far > 0) & (part >= 0) & (part <= 1)
        ranges = np.where(hit & (far < ranges), far, ranges)
    return Scan(np.where(ranges < max_range, ranges, np.inf), ANGLES, max_range, time=time)


def watch(moments: list[Array], poses: list[Pose2], start: float = 0.0) -> tuple[list[Scan], Array]:
    """A scan of each moment's segments at each pose, ten a second."""
    pairs = enumerate(zip(moments, poses, strict=True))
    scans = [scan(segments, pose, start + k / HZ) for k, (segments, pose) in pairs]
    return scans, np.array(poses)


def box(left: float, low: float, right: float, high: float) -> Array:
    """The four sides of a room."""
    return np.array([
        (left, low, right, low), (right, low, right, high), (right, high, left, high),
        (left, high, left, low),
    ], dtype=np.float64)  # fmt: skip


FRONT = np.array([(-2.0, 1.01, -0.45, 1.01), (0.45, 1.01, 2.0, 1.01)])
"""A wall with a doorway of 0.9 m."""
CLOSED = np.array([(-0.45, 1.06, 0.45, 1.06)])
AJAR = np.array([(-0.45, 1.06, -0.45, 1.96)])
"""The leaf at rest when open: along the line of sight of whoever passes, hinged on the left."""
HOUSE = np.concatenate([box(-2.02, -1.01, 2.02, 3.03), FRONT])
