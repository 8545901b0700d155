"""Sessions: saved scans and poses, for continuing a map or localising in it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slam.bounds import MAX_COORDINATE, bounded
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.io.arrays import floats, parsed
from slam.io.files import replacing
from slam.io.scan_arrays import packed_scans, unpacked_scans
from slam.motion.threshold import KEYFRAMES, MotionTrigger
from slam.scan import Scan

FORMAT = "dynslam-session-1"
WHAT = "a map saved by dynslam"


@dataclass(frozen=True)
class Session:
    """Scans and their poses, from which a map of any model can be built.

    scans  in the order of time within a recording; several recordings one after the other
    poses  (n, 3) the robot's pose at each scan, in the map's frame
    """

    scans: tuple[Scan, ...]
    poses: Array

    def __post_init__(self) -> None:
        if not len(self.scans) or self.poses.shape != (len(self.scans), 3):
            raise InputError(
                f"a session has a pose (x, y, theta) for each of its scans, got poses "
                f"{self.poses.shape} for {len(self.scans)} scans"
            )
        if not bounded(self.poses, MAX_COORDINATE):
            raise InputError(
                f"a session has finite poses up to {MAX_COORDINATE:g} m, got NaN or larger ones"
            )

    def keyframes(self) -> Iterator[tuple[Scan, Pose2]]:
        """The scans to integrate, as far apart as a SLAM's keyframes; always including the first of
        each recording, whose clock may be behind that of the one before."""
        since_keyframe = MotionTrigger(KEYFRAMES)
        for scan, row in zip(self.scans, self.poses.tolist(), strict=True):
            pose = Pose2(*row)
            since_keyframe.move_to(pose)
            if scan.time < since_keyframe.time or since_keyframe.due(scan.time):
                since_keyframe.restart(scan.time, pose)
                yield scan, pose

    def followed_by(self, scans: Sequence[Scan], poses: Array) -> Session:
        """This session with further scans and their poses (n, 3) appended."""
        return Session((*self.scans, *scans), np.vstack([self.poses, poses]))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to `path` (.npz) atomically. Raises InputError."""
        with replacing(path) as file:
            np.savez_compressed(
                file, allow_pickle=False, format=FORMAT, poses=self.poses,
                **packed_scans(self.scans),
            )  # fmt: skip

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Session:
        """Read what `save` wrote. Raises InputError for anything else; never runs a pickle."""
        return parsed(path, WHAT, FORMAT, _session)


def _session(data: dict[str, Any]) -> Session:
    return Session(unpacked_scans(data), floats(data["poses"], 2))


def session_of(episode: Episode, poses: Array) -> Session:
    """The session of the first n scans of an episode, with their estimated poses (n, 3)."""
    return Session(episode.scans[: len(poses)], np.asarray(poses, dtype=np.float64))
