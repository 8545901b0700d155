"""The true surface that the scans of an episode saw: the reference of the map scores."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.episode import Truth
from slam.geometry import Array, Pose2
from slam.grid import GridSpec
from slam.kernel import kernel
from slam.scan import Scan

DOOR_MARGIN = 2.0  # m around the walls in which doors may swing


class TrueSurface(NamedTuple):
    """All true surfaces at one moment.

    segments  (w, 4) m
    points    (n, 2) m, samples of the part that was seen so far. Every segment is divided into
              equal pieces of at most half a cell, with one sample in the middle of each. A share of
              the points is not exactly a share of the length: a shorter piece, such as a segment
              shorter than half a cell, counts as much as a longer one.
    """

    segments: Array
    points: Array


class SeenSurface:
    """The part of the true surface that scans have seen from the true poses. Grows with each scan.

    A piece of surface counts as seen if a beam ended in its cell or one of the eight neighbours, so
    that a map is not penalised for unseen corners of a room. A door counts as seen if anything was
    ever seen at its present position.
    """

    def __init__(self, walls: Array, resolution: float = 0.05) -> None:
        self._walls = walls
        ends = walls.reshape(-1, 2) if len(walls) else np.zeros((1, 2))
        low, high = ends.min(axis=0) - DOOR_MARGIN, ends.max(axis=0) + DOOR_MARGIN
        self.spec = GridSpec.around((low[0], low[1]), (high[0], high[1]), resolution)
        self._seen = np.zeros(self.spec.shape, dtype=np.bool_)
        self._wall_points = sampled(walls, resolution / 2)

    def see(self, scan: Scan, pose: Pose2) -> None:
        """Add a scan taken at the true `pose`."""
        spec = self.spec
        _mark(scan.points, *pose, spec.resolution, spec.row0, spec.col0, self._seen)

    def now(self, doors: Array) -> TrueSurface:
        """The surface with the `doors` (d, 4), m, in their present position."""
        points = np.concatenate([self._wall_points, sampled(doors, self.spec.resolution / 2)])
        rows, cols = self.spec.cells(points).T
        inside = (rows >= 0) & (rows < self.spec.rows) & (cols >= 0) & (cols < self.spec.cols)
        points, rows, cols = points[inside], rows[inside], cols[inside]
        return TrueSurface(np.concatenate([self._walls, doors]), points[self._seen[rows, cols]])


def visible_truth(truth: Truth, scans: Sequence[Scan], resolution: float = 0.05) -> TrueSurface:
    """The surface at the time of the last scan, with the part that any of the scans saw."""
    seen = SeenSurface(truth.walls, resolution)
    for scan, pose in zip(scans, truth.poses.tolist(), strict=True):
        seen.see(scan, Pose2(*pose))
    return seen.now(truth.doors[-1])


def sampled(segments: Array, spacing: float) -> Array:
    """(n, 2) points on segments (w, 4), in the middles of equal pieces no longer than `spacing`."""
    if not len(segments):
        return np.empty((0, 2))
    lengths = np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])
    pieces = np.ceil(lengths / spacing - 1e-9).astype(np.int64)
    owner = np.repeat(np.arange(len(segments)), pieces)
    first = np.repeat(np.cumsum(pieces) - pieces, pieces)
    t = (np.arange(len(owner)) - first + 0.5) / pieces[owner]
    return segments[owner, :2] + t[:, None] * (segments[owner, 2:] - segments[owner, :2])


@kernel
def _mark(points, x, y, theta, resolution, row0, col0, seen):
    """Set the cells of points (n, 2), in the frame of a pose, and their eight neighbours."""
    rows, cols = seen.shape
    c, s = np.cos(theta), np.sin(theta)
    for k in range(len(points)):
        i = int(np.floor((s * points[k, 0] + c * points[k, 1] + y) / resolution)) - row0
        j = int(np.floor((c * points[k, 0] - s * points[k, 1] + x) / resolution)) - col0
        for row in range(max(i - 1, 0), min(i + 2, rows)):
            for col in range(max(j - 1, 0), min(j + 2, cols)):
                seen[row, col] = True
