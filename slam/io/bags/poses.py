"""The odometry of a ROS recording: a topic of nav_msgs/Odometry, or frames of /tf."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np

from slam.geometry import Array
from slam.io.bags.transforms import is_valid_transform, plain

ODOMETRY = "nav_msgs/msg/Odometry"
TRUTH_NAMES = ("truth", "groundtruth", "_gt", "/gt")  # parts of the names of topics


class Stamped(NamedTuple):
    """The poses of a topic.

    received  (n,) s, when each was recorded
    times     (n,) s, the stamps
    poses     (n, 3)
    frame     child frame of the poses; empty if the topic does not give it
    """

    received: Array
    times: Array
    poses: Array
    frame: str


class Poses:
    """Collects the poses of one topic."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._frames: defaultdict[str, int] = defaultdict(int)

    def add(self, received: float, message: Any) -> bool:
        """Add a nav_msgs/Odometry or any stamped pose; False for an invalid one."""
        pose = message.pose
        pose = getattr(pose, "pose", pose)
        at, q = pose.position, pose.orientation
        if not is_valid_transform((at.x, at.y, at.z), (q.x, q.y, q.z, q.w)):
            return False
        # of any length: not every driver writes unit quaternions
        yaw = math.atan2(2 * (q.w * q.z + q.x * q.y), q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z)
        row = (received, stamp(message, received), at.x, at.y, yaw)
        self._rows.append(row)
        self._frames[plain(getattr(message, "child_frame_id", ""))] += 1
        return True

    def collected(self) -> Stamped:
        """All poses, in the order in which they were added."""
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, 5)
        frame = max(self._frames, key=self._frames.__getitem__) if self._frames else ""
        return Stamped(rows[:, 0], rows[:, 1], rows[:, 2:], frame)


def stamp(message: Any, received: float) -> float:
    """A message's stamp, s; the time of its reception where it has none."""
    time = message.header.stamp
    return time.sec + time.nanosec * 1e-9 or received


def is_truth(topic: str) -> bool:
    """Whether a topic is a reference rather than odometry, by its name."""
    return any(word in topic.lower() for word in TRUTH_NAMES)
