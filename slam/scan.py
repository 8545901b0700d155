"""Scan: the laser measurement that a SLAM receives."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from slam.bounds import (
    MAX_ANGLE,
    MAX_BEAM_TIME,
    MAX_MOUNT,
    MAX_RANGE,
    MAX_TIME,
    all_within,
    bounded,
)
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.kernel import kernel

PIECE = 0.1  # m, of a surface that counts once


class Directions:
    """The directions of the last beams that were asked for: the scans of a laser share them."""

    def __init__(self) -> None:
        self._last: tuple[object, Array] = None, np.empty((0, 2))  # key, directions

    def of(self, angles: Array, turn: float) -> Array:
        """(beams, 2) unit vectors of beams at `angles` of a sensor turned by `turn`; read-only."""
        key, last = (turn, angles.dtype, angles.tobytes()), self._last
        if key == last[0]:  # `last` was read once: another thread may replace it
            return last[1]
        turned, directions = angles + turn, np.empty((len(angles), 2))
        np.cos(turned, out=directions[:, 0])
        np.sin(turned, out=directions[:, 1])
        directions.flags.writeable = False
        self._last = key, directions
        return directions


DIRECTIONS = Directions()


@dataclass(frozen=True)
class Scan:
    """One sweep of a planar laser.

    ranges     (beams,) m; `inf` or a value at or above `max_range` means no echo; NaN or a value
               below `min_range` means no valid reading
    angles     (beams,) rad, in the sensor's frame, 0 straight ahead, counter-clockwise
    max_range  m, maximum range of the sensor
    min_range  m, readings below it are invalid
    time       s
    mount      pose of the sensor on the robot (robot_from_sensor)
    beam_time  s from a beam to the next; `time` is that of the first beam
               (see `slam.preprocessing.deskewing`)
    """

    ranges: Array
    angles: Array
    max_range: float
    min_range: float = 0.0
    time: float = 0.0
    mount: Pose2 = field(default=Pose2())
    beam_time: float = 0.0

    def __post_init__(self) -> None:
        if self.ranges.ndim != 1 or self.ranges.shape != self.angles.shape:
            raise InputError(
                f"a scan has one range and one angle per beam, but ranges have shape "
                f"{self.ranges.shape} and angles {self.angles.shape}"
            )
        if not (bounded(self.angles, MAX_ANGLE) and abs(self.time) <= MAX_TIME):
            raise InputError(
                f"a scan has finite angles up to {MAX_ANGLE:g} rad and a finite time up to "
                f"{MAX_TIME:g} s"
            )
        if not (all_within(self.mount, MAX_MOUNT) and abs(self.beam_time) <= MAX_BEAM_TIME):
            raise InputError(
                f"a scan has a finite mount up to {MAX_MOUNT:g} m or rad and a beam_time up to "
                f"{MAX_BEAM_TIME:g} s, got {tuple(self.mount)} and {self.beam_time}"
            )
        if not 0.0 <= self.min_range < self.max_range <= MAX_RANGE:
            raise InputError(
                f"a scan needs 0 <= min_range < max_range <= {MAX_RANGE:g} m, "
                f"got min_range={self.min_range}, max_range={self.max_range}"
            )

    def bare(self) -> Scan:
        """The same scan without what was computed of it so far; not validated again."""
        scan = object.__new__(type(self))
        vars(scan).update({name: getattr(self, name) for name in self.__dataclass_fields__})
        return scan

    @cached_property
    def hit(self) -> np.ndarray:
        """(beams,) bool: an echo within the sensor's range."""
        return _hit(self.ranges, self._number(self.min_range), self._number(self.max_range))

    @cached_property
    def no_echo(self) -> np.ndarray:
        """(beams,) bool: no obstacle within the sensor's range."""
        return self.ranges >= self._number(self.max_range)

    def _number(self, limit: float) -> np.floating:
        """A limit in the precision of the ranges: a reading of 5.7 m in single precision is not
        below 5.7 m."""
        ranges = self.ranges.dtype
        return ranges.type(limit) if ranges.kind == "f" else np.float64(limit)

    @cached_property
    def directions(self) -> Array:
        """(beams, 2) unit vectors of the beams in the robot's frame."""
        return DIRECTIONS.of(self.angles, self.mount.theta)

    @cached_property
    def points(self) -> Array:
        """(hits, 2) end points of the beams with an echo, m, in the robot's frame."""
        least, most = self._number(self.min_range), self._number(self.max_range)
        hit, points = _echoes(
            self.ranges, self.directions, least, most, self.mount.x, self.mount.y
        )  # both at once: nearly all scans are asked for both
        vars(self).setdefault("hit", hit)
        return points

    @cached_property
    def views(self) -> Array:
        """(hits, 2) unit vectors from the laser to the echoes, in the robot's frame."""
        return self.directions[self.hit]

    @cached_property
    def pieces(self) -> Array:
        """(n, 2) of the end points those that are PIECE from the one before: a leaf right before
        the laser fills half of its beams, but is no more than its length of what the robot sees."""
        return _pieces(self.points)


@kernel
def _hit(ranges, least, most):
    hit = np.empty(len(ranges), np.bool_)
    for k in range(len(ranges)):
        hit[k] = least <= ranges[k] < most and ranges[k] > 0.0
    return hit


@kernel
def _echoes(ranges, directions, least, most, x, y):
    """See `Scan.hit` and `Scan.points`."""
    hit = _hit(ranges, least, most)
    points = np.empty((hit.sum(), 2))
    n = 0
    for k in range(len(ranges)):
        if hit[k]:
            points[n, 0] = directions[k, 0] * ranges[k] + x
            points[n, 1] = directions[k, 1] * ranges[k] + y
            n += 1
    return hit, points


@kernel
def _pieces(points):
    kept = np.empty(len(points), np.int64)
    number = last = 0
    for k in range(len(points)):
        dx, dy = points[k, 0] - points[last, 0], points[k, 1] - points[last, 1]
        if k == 0 or dx * dx + dy * dy > PIECE * PIECE:
            kept[number] = last = k
            number += 1
    return points[kept[:number]]
