"""ROS LaserScans as a `Scan` has them (sensor_msgs/LaserScan, REP 117)."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from slam.bounds import MAX_BEAM_TIME
from slam.geometry import Array
from slam.io.bags.poses import stamp
from slam.io.bags.transforms import plain

LASER = "sensor_msgs/msg/LaserScan"
MULTI_ECHO = "sensor_msgs/msg/MultiEchoLaserScan"


class Sweep(NamedTuple):
    """One LaserScan.

    received  s, time of recording
    time      s, its stamp
    ranges    (beams,) m, as written
    angles    (beams,) rad in the laser's frame, clockwise or counter-clockwise
    reach     range_min and range_max, m, as written
    frame     the laser's
    step      s from a beam to the next
    """

    received: float
    time: float
    ranges: Array
    angles: Array
    reach: tuple[float, float]
    frame: str
    step: float


def sweep(received: float, message: Any) -> Sweep | None:
    """A message's sweep; None if it has no beams or no valid angles."""
    with np.errstate(invalid="ignore"):  # a signalling NaN is a NaN
        ranges = np.asarray(message.ranges, dtype=np.float64)
    angles = _fan(
        len(ranges),
        float(message.angle_min), float(message.angle_max), float(message.angle_increment),
    )  # fmt: skip
    if angles is None:
        return None
    reach = float(message.range_min), float(message.range_max)
    time = stamp(message, received)
    frame, step = plain(message.header.frame_id), float(message.time_increment)
    step = step if 0 <= step <= MAX_BEAM_TIME else 0.0
    return Sweep(received, time, ranges, angles, reach, frame, step)


def readings(ranges: Array, low: float, high: float) -> Array:
    """(beams,) m of a laser that reaches from `low` to `high`: no echo is inf, no reading NaN.

    REP 117: +inf and any range beyond `high` is no echo, -inf too near, NaN an error. Old
    drivers write 0 for no reading.
    """
    with np.errstate(invalid="ignore"):
        return np.where(
            ranges >= high, np.inf, np.where((ranges >= low) & (ranges > 0), ranges, np.nan)
        )


@lru_cache(maxsize=64)
def _fan(beams: int, first: float, last: float, step: float) -> Array | None:
    """(beams,) rad; by the first and last angle where the step is 0 or spans over a full turn. None
    if these are invalid, too."""
    if not (beams and abs(first) <= 2 * math.tau):
        return None
    if beams == 1:
        step = 0.0
    elif not (step and abs(step) * (beams - 1) <= math.tau + 0.01):
        if not (0 < abs(last - first) <= math.tau + 0.01):
            return None
        step = (last - first) / (beams - 1)
    angles = first + step * np.arange(beams, dtype=np.float64)
    angles.flags.writeable = False
    return angles
