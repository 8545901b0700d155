"""The paths of particles, which share their past."""

from __future__ import annotations

import numpy as np

from slam.geometry import Array, Pose2, compose


class ParticlePaths:
    """The pose of every particle at each keyframe, and the displacements of all scans from there.

    poses    of each keyframe (particles, 3), after the particles were resampled
    parents  of each keyframe (particles,), the index of each particle in the keyframe before
    """

    def __init__(self) -> None:
        self.poses: list[Array] = []
        self.parents: list[np.ndarray] = []
        self._keyframes: list[int] = []  # of each scan, the number of the last keyframe,
        self._ways: list[Pose2] = []  # and the displacement from there

    def add_keyframe(self, poses: Array, parents: np.ndarray) -> None:
        """Add the poses (particles, 3) of a keyframe, and the parents (particles,) there."""
        self.poses.append(poses.copy())
        self.parents.append(parents)

    def add_scan(self, pose: Pose2, particle: int) -> None:
        """Add the pose of a scan, estimated by a particle."""
        self._keyframes.append(len(self.poses) - 1)
        self._ways.append(Pose2.of(self.poses[-1][particle]).between(pose))

    def trajectory(self, particle: int) -> Array:
        """(n, 3) the pose of every scan, on the path of a particle."""
        if not self._ways:
            return np.zeros((0, 3))
        path = np.array([poses[particle] for poses in self.last(len(self.poses))])
        return compose(path[self._keyframes], np.array(self._ways))

    def last(self, number: int) -> list[Array]:
        """The poses (particles, 3) of so many last keyframes on the paths of the particles."""
        found, ancestors = [], np.arange(len(self.poses[-1]))
        for poses, parents in zip(self.poses[: -number - 1 : -1], self.parents[::-1], strict=False):
            found.append(poses[ancestors])
            ancestors = parents[ancestors]
        return found[::-1]
