"""Episode: all that one drive recorded, and the truth where it is known. Saved as .npz."""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2, between
from slam.io.files import replacing
from slam.scan import Scan
from slam.trajectory import Trajectory

FORMAT = "dynslam-episode-1"
UNREADABLE = (OSError, EOFError, ValueError, KeyError, TypeError, RuntimeError, zlib.error,
              zipfile.BadZipFile)  # fmt: skip


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
    meta      what made it: configuration, seed, source; any JSON
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
            "beams": np.array([len(scan.ranges) for scan in self.scans]),
            "ranges": np.concatenate([scan.ranges for scan in self.scans]),
            "angles": np.concatenate([scan.angles for scan in self.scans]),
            "limits": np.array([(s.max_range, s.min_range, s.time) for s in self.scans]),
            "mounts": np.array([scan.mount for scan in self.scans]),
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
        try:
            with np.load(path, allow_pickle=False) as stored:
                data = {name: stored[name] for name in stored.files}
            if str(data["format"]) != FORMAT:
                raise InputError(f"{path}: format {data['format']}, expected {FORMAT}")
            return _episode(data)
        except InputError:
            raise
        except FileNotFoundError:
            raise InputError(f"{path}: no such file") from None
        except UNREADABLE as error:
            raise InputError(f"{path}: not an episode saved by dynslam ({error})") from error


def _episode(data: dict[str, Any]) -> Episode:
    ends = np.cumsum(data["beams"])[:-1]
    rows = zip(
        np.split(data["ranges"], ends),
        np.split(data["angles"], ends),
        data["limits"].tolist(),
        data["mounts"].tolist(),
        strict=True,
    )
    scans = tuple(
        Scan(ranges, angles, max_range, min_range, time, Pose2(*mount))
        for ranges, angles, (max_range, min_range, time), mount in rows
    )
    truth = None
    if "truth_poses" in data:
        truth = Truth(data["truth_poses"], data["truth_walls"], data["truth_doors"])
    odometry = Trajectory(data["odometry_times"], data["odometry_poses"])
    return Episode(scans, odometry, truth, json.loads(str(data["meta"])))
