"""Sessions: saved scans and poses, for continuing a map or localising in it, and doors."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slam.bounds import MAX_COORDINATE, bounded
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.io.arrays import floats, parsed
from slam.io.door_memory import RememberedDoor, packed_doors, unpacked_doors
from slam.io.files import replacing
from slam.io.scan_arrays import packed_scans, unpacked_scans
from slam.motion.threshold import KEYFRAMES, MotionTrigger
from slam.scan import Scan

FORMAT = "dynslam-session-1"
WHAT = "a map saved by dynslam"
MOST_RECORDINGS = 2**40
DATED = 1e9  # s: earlier stamps are not unix time of a robot (2001)


@dataclass(frozen=True)
class Session:
    """Scans and their poses, from which a map of any model can be built.

    scans       in the order of time within a recording; several recordings one after the other
    poses       (n, 3) the robot's pose at each scan, in the map's frame
    recordings  (n,) the number of the recording of each scan, increasing; default: another one
                begins where the time goes back
    doors       what is remembered of doors
    """

    scans: tuple[Scan, ...]
    poses: Array
    recordings: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    doors: tuple[RememberedDoor, ...] = ()

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
        if not len(self.recordings):
            object.__setattr__(
                self, "recordings", np.cumsum(np.diff(self.times, prepend=-np.inf) < 0)
            )
        if len(self.recordings) != len(self.scans) or (np.diff(self.recordings) < 0).any():
            raise InputError("a session has one number of a recording for each scan, increasing")

    @property
    def times(self) -> Array:
        """(n,) s, the scans' stamps."""
        return np.array([scan.time for scan in self.scans])

    def keyframes(self) -> Iterator[tuple[Scan, Pose2]]:
        """The scans to integrate, as far apart as a SLAM's keyframes; always including the first of
        each recording, whose clock may be behind that of the one before."""
        since_keyframe, before = MotionTrigger(KEYFRAMES), -1
        rows = zip(self.scans, self.poses.tolist(), self.recordings.tolist(), strict=True)
        for scan, row, recording in rows:
            pose = Pose2(*row)
            since_keyframe.move_to(pose)
            if recording != before or since_keyframe.due(scan.time):
                before = recording
                since_keyframe.restart(scan.time, pose)
                yield scan, pose

    def followed_by(self, scans: Sequence[Scan], poses: Array) -> Session:
        """This session with another recording appended: scans and their poses (n, 3)."""
        number = np.full(len(scans), self.recordings[-1] + 1)
        return replace(
            self,
            scans=(*self.scans, *scans),
            poses=np.vstack([self.poses, poses]),
            recordings=np.concatenate([self.recordings, number]),
        )

    def kept(self, which: np.ndarray) -> Session:
        """The session of some of the scans, (n,) bool."""
        scans = tuple(self.scans[k] for k in np.flatnonzero(which).tolist())
        return replace(
            self, scans=scans, poses=self.poses[which], recordings=self.recordings[which]
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to `path` (.npz) atomically. Raises InputError."""
        with replacing(path) as file:
            np.savez_compressed(
                file, allow_pickle=False, format=FORMAT, poses=self.poses,
                recordings=self.recordings, **packed_scans(self.scans),
                **packed_doors(self.doors),
            )  # fmt: skip

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Session:
        """Read what `save` wrote. Raises InputError for anything else; never runs a pickle."""
        return parsed(path, WHAT, FORMAT, _session)


def _session(data: dict[str, Any]) -> Session:
    scans, poses = unpacked_scans(data), floats(data["poses"], 2)
    recordings = floats(data.get("recordings", np.empty(0)), 1)  # absent in old files
    if not (np.abs(recordings) <= MOST_RECORDINGS).all():
        raise InputError("the numbers of recordings must be whole numbers")
    return Session(scans, poses, recordings.astype(np.int64), unpacked_doors(data))


def session_of(episode: Episode, poses: Array) -> Session:
    """The session of the first n scans of an episode, with their estimated poses (n, 3)."""
    return Session(episode.scans[: len(poses)], np.asarray(poses, dtype=np.float64))


def is_dated(time: float) -> bool:
    """Whether a stamp, s, is unix time, and not counted from the beginning of a recording."""
    return time >= DATED


def check_order(session: Session, episode: Episode) -> None:
    """Raise InputError if an episode begins before the end of a session of unix time: doors are
    learned in the order of time."""
    last, first = float(session.times.max()), episode.scans[0].time
    if is_dated(last) and first < last:
        raise InputError(
            f"the recording begins at {_date(first)}, before the end of the map's last one at "
            f"{_date(last)}: was the clock set back? Recordings continue a map in the order of time"
        )


def _date(time: float) -> str:
    return str(np.datetime64(round(time), "s")).replace("T", " ")
