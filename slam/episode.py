"""Episode: all that one drive recorded, and the truth where it is known. Saved as .npz."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2, between
from slam.io.arrays import UNREADABLE, floats, read_arrays
from slam.io.files import replacing
from slam.io.told import told
from slam.packing import packed_scans, unpacked_scans
from slam.scan import Scan
from slam.trajectory import Trajectory

FORMAT = "dynslam-episode-1"
WHAT = "an episode saved by dynslam"


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

    @property
    def times(self) -> Array:
        """(n,) s, the scans' stamps."""
        return np.array([scan.time for scan in self.scans])

    @property
    def has_odometry(self) -> bool:
        """Whether anything told how the robot moved."""
        return self.meta.get("odometry") != ""

    def motions(self) -> list[Pose2]:
        """What the odometry says the robot moved before each scan, in its frame; first: zero."""
        poses = self.odometry.at(self.times)
        moved = between(poses[:-1], poses[1:])
        return [Pose2(), *(Pose2(*row) for row in moved.tolist())]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to `path` (.npz), through a temporary file: a killed run leaves no half of one.

        Raises InputError where it cannot be written.
        """
        arrays: dict[str, Any] = {
            "format": FORMAT,
            "meta": json.dumps(dict(self.meta)),
            **packed_scans(self.scans),
            "odometry_times": self.odometry.times,
            "odometry_poses": self.odometry.poses,
        }
        if self.truth is not None:
            arrays |= {
                "truth_poses": self.truth.poses,
                "truth_walls": self.truth.walls,
                "truth_doors": self.truth.doors,
            }
        with replacing(path) as file:
            np.savez_compressed(file, **arrays)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Episode:
        """Read what `save` wrote. Raises InputError for anything else; never runs a pickle."""
        data = read_arrays(path, WHAT)
        try:
            if str(data["format"]) != FORMAT:
                raise InputError(f"format {told(data['format'], 60)}, expected {FORMAT}")
            return _episode(data)
        except UNREADABLE as error:
            raise InputError(f"{path}: not {WHAT} ({told(error)})") from error


def _episode(data: dict[str, Any]) -> Episode:
    truth = None
    if "truth_poses" in data:
        poses, walls = floats(data["truth_poses"], 2), floats(data["truth_walls"], 2)
        truth = Truth(poses, walls, floats(data["truth_doors"], 3))
        if (poses.shape[1], walls.shape[1]) != (3, 4) or truth.doors.shape[::2] != (len(poses), 4):
            raise InputError("the truth has poses (n, 3), walls (w, 4) and doors (n, d, 4)")
    odometry = Trajectory(floats(data["odometry_times"], 1), floats(data["odometry_poses"], 2))
    meta = json.loads(str(data["meta"]))
    if not isinstance(meta, dict):
        raise InputError("meta must be an object of JSON")
    return Episode(unpacked_scans(data), odometry, truth, meta)
