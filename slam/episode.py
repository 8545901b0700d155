"""Episode: the recorded scans and odometry of one drive, and the ground truth if known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2, between
from slam.scan import Scan
from slam.trajectory import Trajectory


@dataclass(frozen=True)
class Truth:
    """Ground truth, from a simulation or a reference system.

    poses   (n, 3) the robot's pose at every scan, in the world
    walls   (w, 4) static segments x1, y1, x2, y2, m
    doors   (n, d, 4) outline segments of everything that moves, at every scan
    """

    poses: Array
    walls: Array
    doors: Array


@dataclass(frozen=True)
class Episode:
    """One drive: scans in the order of time, and the odometry beside them.

    odometry  at least one pose a scan; a log may hold more. In the odometry's own frame.
    meta      provenance: configuration, seed, source; any JSON. Its `odometry` is the source of the
              odometry; an empty one means that there is none, and `odometry` is constant
    """

    scans: tuple[Scan, ...]
    odometry: Trajectory
    truth: Truth | None = None
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.scans:
            raise InputError("an episode holds at least one scan, got none")
        if self.truth is not None and len(self.truth.poses) != len(self.scans):
            raise InputError(
                f"the truth has one pose a scan, got {len(self.truth.poses)} poses "
                f"for {len(self.scans)} scans"
            )

    def known_truth(self, need: str) -> Truth:
        """The truth. Raises InputError if the episode holds none; the message names `need`, such as
        "a score", which needs it."""
        if self.truth is None:
            raise InputError(f"{need} needs an episode that holds the truth, and this one does not")
        return self.truth

    @property
    def times(self) -> Array:
        """(n,) s, the scans' stamps."""
        return np.array([scan.time for scan in self.scans])

    @property
    def has_odometry(self) -> bool:
        """Whether the recording has odometry."""
        return self.meta.get("odometry") != ""

    def displacements(self) -> list[Pose2]:
        """Odometry displacements from scan to scan, in the robot's frame; the first is zero."""
        poses = self.odometry.at(self.times)
        moved = between(poses[:-1], poses[1:])
        return [Pose2(), *(Pose2(*row) for row in moved.tolist())]
