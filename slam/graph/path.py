"""The robot's path: its pose at every update, each in the frame of a local map."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2, between, compose

INITIAL_UPDATES = 1024  # capacity of the arrays, which is doubled when they are full


class Path:
    """A growing list of poses, 28 bytes each: the only part of a graph that grows with time."""

    def __init__(self) -> None:
        self._n = 0
        self._numbers = np.empty(INITIAL_UPDATES, np.int32)
        self._within = np.empty((INITIAL_UPDATES, 3))

    def __len__(self) -> int:
        return self._n

    def append(self, number: int, pose: Pose2) -> None:
        """Add a pose, in the frame of local map `number`."""
        if self._n == len(self._numbers):
            self._numbers = np.concatenate([self._numbers, np.empty_like(self._numbers)])
            self._within = np.concatenate([self._within, np.empty_like(self._within)])
        self._numbers[self._n], self._within[self._n] = number, pose
        self._n += 1

    def poses(self, frames: Array) -> Array:
        """(n, 3) the poses, where the local maps have `frames` (maps, 3)."""
        return compose(frames[self._numbers[: self._n]], self._within[: self._n])

    def last(self, frames: Array) -> Pose2:
        """The last of the poses."""
        return Pose2.of(frames[self._numbers[self._n - 1]]) @ Pose2.of(self._within[self._n - 1])

    def rebase(self, since: int, number: int, frame: Pose2) -> None:
        """Give the poses from update `since` on to local map `number`, whose frame is at `frame` in
        the one that they were in."""
        self._numbers[since : self._n] = number
        self._within[since : self._n] = between(frame, self._within[since : self._n])

    def forget(self, number: int, into: int, displacement: Pose2) -> None:
        """Give the poses of a local map to another one, in whose frame it is at `displacement`;
        local maps after it are renumbered."""
        numbers, within = self._numbers[: self._n], self._within[: self._n]
        own = numbers == number
        within[own] = compose(displacement, within[own])
        numbers[own] = into
        numbers[numbers > number] -= 1
