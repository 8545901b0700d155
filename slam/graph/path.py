"""The robot's path: its pose at every update, each in the frame of a local map."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from slam.geometry import Array, Pose2, between, compose, inverse, wrap_angle

INITIAL_UPDATES = 1024  # capacity of the array of poses, which is doubled when it is full
POSE_BYTES = 24  # of a pose in memory
PER_RAD = 0.5  # m, that headings which differ by 1 rad count as
NO_DISTANCE = 1e-300  # m, instead of zero: two keyframes at a pose move it alike
NO_UPDATES = np.empty(0, np.int64)


class Path:
    """A growing list of poses, POSE_BYTES each: the only part of a graph that grows with time.

    Consecutive poses in the frame of one local map are a run. What is done with a local map takes
    time by its own poses and by the number of runs, not by the length of the path.
    """

    def __init__(self) -> None:
        self._n = 0
        self._within = np.empty((INITIAL_UPDATES, 3))  # poses, each in the frame of its local map
        self._begins = np.empty(0, np.int64)  # of the runs
        self._numbers = np.empty(0, np.int64)  # of their local maps

    def __len__(self) -> int:
        return self._n

    def append(self, number: int, pose: Pose2) -> None:
        """Add a pose, in the frame of local map `number`."""
        if self._n == len(self._within):
            longer = np.empty((2 * self._n, 3))  # takes memory as it is filled
            longer[: self._n] = self._within
            self._within = longer
        if not len(self._numbers) or self._numbers[-1] != number:
            self._begin(self._n, number)
        self._within[self._n] = pose
        self._n += 1

    def poses(self, frames: Array) -> Array:
        """(n, 3) the poses, where the local maps have `frames` (maps, 3)."""
        lengths = np.diff(self._begins, append=self._n)
        return compose(np.repeat(frames[self._numbers], lengths, axis=0), self._within[: self._n])

    def last(self, frames: Array) -> Pose2:
        """The last of the poses."""
        return Pose2.of(frames[self._numbers[-1]]) @ Pose2.of(self._within[self._n - 1])

    def rebase(self, since: int, number: int, frame: Pose2) -> None:
        """Give the poses from update `since` on to local map `number`, whose frame is at `frame` in
        the one that they were in."""
        if since >= self._n:
            return
        earlier = self._begins < since
        self._begins, self._numbers = self._begins[earlier], self._numbers[earlier]
        self._begin(since, number)
        self._within[since : self._n] = between(frame, self._within[since : self._n])

    def forget(self, number: int, into: int, displacement: Pose2) -> None:
        """Give the poses of a local map to another one, in whose frame it is at `displacement`;
        local maps after it are renumbered."""
        chosen = self._of(number)
        self._within[chosen] = compose(displacement, self._within[chosen])
        self._numbers[self._numbers == number] = into
        self._numbers[self._numbers > number] -= 1

    def realign(self, number: int, before: Array, after: Array) -> None:
        """Move the poses of a local map with its keyframes, from `before` (n, 3) to `after`: each
        with the two nearest ones, and more with the nearer one."""
        chosen = self._of(number)
        poses = self._within[chosen]
        tree, ranks = KDTree(_places(before)), [1, 2][: len(before)]
        distances, nearest = tree.query(_places(poses), ranks)  # pyright: ignore[reportArgumentType]
        corrections = compose(after, inverse(before))
        moved = compose(corrections[nearest], poses[:, None])
        share = distances[:, 0] / np.maximum(distances.sum(axis=1), NO_DISTANCE)
        moved[:, -1, 2] = moved[:, 0, 2] + wrap_angle(moved[:, -1, 2] - moved[:, 0, 2])
        self._within[chosen] = moved[:, 0] + share[:, None] * (moved[:, -1] - moved[:, 0])

    def _of(self, number: int) -> np.ndarray:
        """The updates whose poses are in the frame of a local map."""
        runs = np.flatnonzero(self._numbers == number)
        ends = np.append(self._begins[1:], self._n)
        own = [np.arange(self._begins[k], ends[k]) for k in runs.tolist()]
        return np.concatenate([NO_UPDATES, *own])

    def _begin(self, since: int, number: int) -> None:
        self._begins = np.append(self._begins, since)
        self._numbers = np.append(self._numbers, number)


def _places(poses: Array) -> Array:
    """(n, 4) m: poses (n, 3) as points whose distances hold those of the headings."""
    x, y, theta = poses.T
    return np.column_stack([x, y, PER_RAD * np.cos(theta), PER_RAD * np.sin(theta)])
