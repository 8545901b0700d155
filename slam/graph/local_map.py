"""Local maps: a stretch of the way, mapped in a frame of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Pose2, transform_points
from slam.scan import Scan

CELL = 0.05  # m: of the echoes in a square of this side one is kept in a panorama
ROWS = 1 << 32  # more squares than lie above each other
SIZE = 400  # echoes of a panorama at most


class Keyframe(NamedTuple):
    """A scan and where it was taken, in the frame of its local map."""

    scan: Scan
    pose: Pose2


class LocalMap:
    """Keyframes that were taken one after the other; their poses are not revised.

    seeds      the last keyframes of the local map before, which this one's map begins with
    keyframes  its own, the first at the origin
    """

    def __init__(self, seeds: Sequence[Keyframe], first: Scan):
        self.seeds = tuple(seeds)
        self.keyframes = [Keyframe(first, Pose2())]
        self.way = 0.0

    def __iter__(self) -> Iterator[Keyframe]:
        """All that its map shows, in the order of time."""
        yield from self.seeds
        yield from self.keyframes

    def add(self, scan: Scan, pose: Pose2) -> None:
        """One more keyframe; `way` is how far they lead, m."""
        before = self.keyframes[-1].pose
        self.way += float(np.hypot(pose.x - before.x, pose.y - before.y))
        self.keyframes.append(Keyframe(scan, pose))

    def following(self, scan: Scan, pose: Pose2, seeds: int) -> LocalMap:
        """The next local map, which begins with a scan at `pose` and so many seeds before it."""
        last = list(self)[-seeds:] if seeds else []
        return LocalMap([Keyframe(one.scan, pose.between(one.pose)) for one in last], scan)

    def middle(self) -> Pose2:
        """The mean place of its own keyframes, heading as the frame does."""
        x, y = np.mean([(one.pose.x, one.pose.y) for one in self.keyframes], axis=0).tolist()
        return Pose2(x, y)

    def panorama(self) -> Scan:
        """Echoes of its own keyframes, thinned out evenly, as if they were one scan's, taken at the
        origin."""
        points = np.concatenate(
            [transform_points(one.pose, one.scan.points) for one in self.keyframes]
        )
        col, row = np.floor(points / CELL).astype(np.int64).T
        _, kept = np.unique(col * ROWS + row, return_index=True)
        chosen = np.linspace(0, len(kept) - 1, min(len(kept), SIZE)).astype(np.int64)
        x, y = points[kept[chosen]].T
        ranges = np.hypot(x, y)
        return Scan(ranges, np.arctan2(y, x), max_range=float(ranges.max(initial=0.0)) + 1.0)
