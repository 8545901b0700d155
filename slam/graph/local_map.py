"""Local maps: consecutive keyframes in a frame of their own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.scan import Scan

PANORAMA_CELL = 0.05  # m, side of the squares in each of which a panorama keeps one echo
MAX_ROWS = 1 << 20  # of such squares, in 10 km to both sides: makes one key of row and column
NO_SQUARE = np.iinfo(np.int64).min  # less than any key
PANORAMA_SIZE = 400  # maximum number of echoes
PATH_STEP = 0.4  # m between the poses of a path


class Keyframe(NamedTuple):
    """A scan and its pose, in the frame of its local map."""

    scan: Scan
    pose: Pose2

    def seen_from(self, pose: Pose2) -> Keyframe:
        """The same, in the frame of a pose."""
        return Keyframe(self.scan, pose.between(self.pose))

    def moved(self, by: Pose2) -> Keyframe:
        """The same, moved by a transform of the frame."""
        return Keyframe(self.scan, by @ self.pose)


class LocalMap:
    """Consecutive keyframes, whose poses are not revised.

    seeds      the last keyframes of the previous local map, which this one's map starts with
    keyframes  its own, the first at the origin
    length     m, of the path along the keyframes
    ordinal    number of local maps before it, those included that were forgotten since
    """

    def __init__(self, seeds: Sequence[Keyframe], first: Scan, ordinal: int = 0):
        self.seeds = tuple(seeds)
        self.ordinal = ordinal
        self.keyframes = [Keyframe(first, Pose2())]
        self.length = 0.0
        self._path: Array | None = None  # once it is compact

    def __iter__(self) -> Iterator[Keyframe]:
        """All keyframes that its map is made of, in the order of time."""
        yield from self.seeds
        yield from self.keyframes

    def add(self, scan: Scan, pose: Pose2) -> None:
        """Add a keyframe."""
        before = self.keyframes[-1].pose
        self.length += float(np.hypot(pose.x - before.x, pose.y - before.y))
        self.keyframes.append(Keyframe(scan, pose))

    def following(self, scan: Scan, pose: Pose2, seeds: int) -> LocalMap:
        """The next local map: its first keyframe is `scan` at `pose`, after so many `seeds`."""
        last = list(self)[-seeds:] if seeds else []
        around = [one.seen_from(pose) for one in last]
        return LocalMap(around, scan, self.ordinal + 1)

    def compact(self) -> None:
        """Keep only what the map can be drawn again from: no seeds, and of its scans no cached
        properties. To be called once its own map was built."""
        self.seeds = ()
        self.keyframes = [Keyframe(scan.bare(), pose) for scan, pose in self.keyframes]
        self._path = self.path()

    def realign(self, poses: Array) -> None:
        """Set the poses (n, 3) of its own keyframes, the first at the origin."""
        scans = [one.scan for one in self.keyframes]
        self.keyframes = [Keyframe(*one) for one in zip(scans, map(Pose2.of, poses), strict=True)]
        if self._path is not None:
            self._path = None
            self._path = self.path()

    def middle(self) -> Pose2:
        """The mean position of its own keyframes, with the heading of the frame."""
        x, y = np.mean([(one.pose.x, one.pose.y) for one in self.keyframes], axis=0).tolist()
        return Pose2(x, y)

    def path(self) -> Array:
        """(n, 3) poses of its own keyframes, about PATH_STEP apart, the first and last included."""
        if self._path is not None:
            return self._path
        last = len(self.keyframes) - 1
        chosen = np.linspace(0, last, min(int(self.length / PATH_STEP) + 1, last) + 1)
        return np.array([self.keyframes[k].pose for k in chosen.round().astype(int).tolist()])

    def panorama(self) -> Panorama:
        """The echoes of its own keyframes, subsampled evenly, as one scan taken at the origin."""
        return panorama(self.keyframes)


@dataclass(frozen=True)
class Panorama(Scan):
    """Echoes of several keyframes as one scan, each seen from where its keyframe was.

    seen  (beams, 2) unit vectors from the laser to the echoes
    """

    seen: Array = field(kw_only=True)

    @cached_property
    def views(self) -> Array:
        """(hits, 2) of `seen`, those of beams with an echo."""
        return self.seen[self.hit]


def panorama(keyframes: Sequence[Keyframe]) -> Panorama:
    """The echoes of keyframes, subsampled evenly, as one scan taken at the origin."""
    echoes = [one.scan.points for one in keyframes]
    owners = np.repeat(np.arange(len(echoes)), [len(points) for points in echoes])
    points = _moved(np.concatenate(echoes), owners, np.array([one.pose for one in keyframes]))
    kept = _first_in_squares(points)
    chosen = kept[np.linspace(0, len(kept) - 1, min(len(kept), PANORAMA_SIZE)).astype(np.int64)]
    points, (x, y) = points[chosen], points[chosen].T
    lasers = np.array([(one.pose @ one.scan.mount)[:2] for one in keyframes])
    views = points - lasers[owners[chosen]]
    ranges, lengths = np.hypot(x, y), np.hypot(*views.T)
    farthest = float(ranges.max(initial=0.0)) + 1.0
    return Panorama(ranges, np.arctan2(y, x), farthest, seen=views / lengths[:, None])


@kernel
def _moved(points, owners, poses):
    """Points (n, 2), each given in the frame of the pose (k, 3) of its owner, in that of poses."""
    moved, c, s = np.empty_like(points), np.cos(poses[:, 2]), np.sin(poses[:, 2])
    for k in range(len(points)):
        m = owners[k]
        moved[k, 0] = poses[m, 0] + c[m] * points[k, 0] - s[m] * points[k, 1]
        moved[k, 1] = poses[m, 1] + s[m] * points[k, 0] + c[m] * points[k, 1]
    return moved


def _first_in_squares(points: Array) -> np.ndarray:
    """The numbers of the first of the points (n, 2) in each square, column by column."""
    col, row = np.floor(points / PANORAMA_CELL).astype(np.int64).T
    n = max(len(points), 1)
    keys = np.sort((col * MAX_ROWS + row) * n + np.arange(len(points)))
    return keys[np.flatnonzero(np.diff(keys // n, prepend=NO_SQUARE))] % n
