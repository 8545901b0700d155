"""Trajectory: timed poses, from odometry, ground truth, or a SLAM."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slam.bounds import MAX_COORDINATE, MAX_TIME, bounded
from slam.errors import InputError
from slam.geometry import Array, wrap_angle


@dataclass(frozen=True)
class Trajectory:
    """times (n,) s, strictly increasing; poses (n, 3) as x, y in m and theta in rad."""

    times: Array
    poses: Array

    def __post_init__(self) -> None:
        if self.times.ndim != 1 or self.poses.shape != (len(self.times), 3):
            raise InputError(
                f"a trajectory has times (n,) and poses (n, 3), "
                f"got {self.times.shape} and {self.poses.shape}"
            )
        if not len(self.times):
            raise InputError("a trajectory has one pose at least, got none")
        if not (bounded(self.times, MAX_TIME) and bounded(self.poses, MAX_COORDINATE)):
            raise InputError(
                f"a trajectory has finite times up to {MAX_TIME:g} s and finite poses up to "
                f"{MAX_COORDINATE:g} m or rad, got NaN, infinity or larger ones"
            )
        if (np.diff(self.times) <= 0).any():
            at = int(np.argmax(np.diff(self.times) <= 0))
            raise InputError(
                f"the times of a trajectory increase, but row {at + 1} "
                f"({self.times[at + 1]:.6f} s) follows row {at} ({self.times[at]:.6f} s)"
            )

    def __len__(self) -> int:
        return len(self.times)

    def at(self, times: Array) -> Array:
        """Poses (m, 3) at `times`, interpolated (heading the shorter way); clamped at the ends."""
        x, y, theta = (np.interp(times, self.times, column) for column in self._columns)
        return np.column_stack([x, y, wrap_angle(theta)])

    @cached_property
    def _columns(self) -> tuple[Array, Array, Array]:
        """x, y and the unwrapped heading; cached, because `at` is called for every scan."""
        x, y, theta = np.ascontiguousarray(self.poses.T)
        return x, y, np.unwrap(theta)
