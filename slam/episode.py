"""Episode: the recorded scans and odometry of one drive, and the truth where it is known."""

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
    """What only a simulation (or a reference system) knows.

    poses   (n, 3) the robot at every scan, in the world
    walls   (w, 4) segments x1, y1, x2, y2 in m that never move
    doors   (n, d, 4) outline segments of whatever moves, at every scan
    """

    poses: Array
    walls: Array
    doors: Array


@dataclass(frozen=True)
class Episode:
    """One drive: scans in the order of time, and the odometry beside them.

    odometry  at least one pose a scan; a log may hold more. Its frame is the odometry's own.
    meta      what made it: configuration, seed, source; any JSON. `odometry` in it says where the
              odometry is from; empty: nowhere, and it stands still
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
        """The truth. Raises InputError where the episode holds none: `need`, such as "a score",
        needs it."""
        if self.truth is None:
            raise InputError(f"{need} needs an episode that holds the truth, and this one does not")
        return self.truth

    @property
    def times(self) -> Array:
        """(n,) s, the scans' stamps."""
        return np.array([scan.time for scan in self.scans])

    @property
    def has_odometry(self) -> bool:
        """Whether anything told how the robot moved."""
        return self.meta.get("odometry") != ""

    def displacements(self) -> list[Pose2]:
        """What the odometry says the robot moved before each scan, in its frame; first: zero."""
        poses = self.odometry.at(self.times)
        moved = between(poses[:-1], poses[1:])
        return [Pose2(), *(Pose2(*row) for row in moved.tolist())]
