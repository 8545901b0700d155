"""The messages ODOM, FLASER, ROBOTLASER1 and PARAM of a CARMEN log, a line each.

Field order as in the logs' own headers (CARMEN, Montemerlo, Roy, Thrun et al., 2002).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from slam.bounds import MAX_COORDINATE, MAX_MOUNT, MAX_RANGE, MAX_TIME, all_within
from slam.geometry import Array, Pose2

# Settings of the front laser that a log may state, and their bounds.
PARAMS = {
    b"robot_frontlaser_offset": (-10.0, 10.0),  # m, forward
    b"robot_frontlaser_side_offset": (-10.0, 10.0),  # m, to the left
    b"robot_frontlaser_angular_offset": (-7.0, 7.0),  # rad
    b"robot_front_laser_max": (0.0, MAX_RANGE),  # m, 0: not stated
    b"laser_front_laser_max": (0.0, MAX_RANGE),
    b"laser_front_laser_resolution": (0.0, 180.0),  # degrees between beams, 0: not stated
}
# FLASER: beams -> degrees between them (SICK LMS). An even count lacks the odd one's last beam.
FLASER_STEP_DEG = {180: 1.0, 181: 1.0, 360: 0.5, 361: 0.5, 400: 0.25, 401: 0.25}


class Garbled(ValueError):  # noqa: N818 (counted as a warning, never shown as an error)
    """A line is not a valid message of its kind; the text says what was expected."""


class Odom(NamedTuple):
    """ODOM x y theta tv rv accel ipc_time host logger_time: the robot's pose (m, rad), time (s)."""

    time: float
    pose: Pose2


class LaserMessage(NamedTuple):
    """One sweep as it is in the log.

    robot      pose by the odometry; m, rad
    ranges     (beams,) m, as written
    angles     (beams,) rad, or None if implied by convention (FLASER)
    max_range  m, or None if the line does not say
    mount      the sensor on the robot, or None if the line does not say
    """

    time: float
    pose: Pose2
    ranges: Array
    angles: Array | None = None
    max_range: float | None = None
    mount: Pose2 | None = None


def parse_odom(words: list[bytes]) -> Odom:
    """Raises Garbled."""
    if not 9 <= len(words) <= 10:
        raise Garbled("ODOM with 6 numbers, time, host, time was expected")
    return Odom(_time(words[7]), _pose(words[1:4]))


def parse_flaser(words: list[bytes]) -> LaserMessage:
    """FLASER n r1..rn x y theta odom_x odom_y odom_theta ipc_time host logger_time.

    The first pose may be a corrected one, so it is not read: the odometry is the second. Raises
    Garbled.
    """
    n = _count(words, 1)
    if not n + 10 <= len(words) <= n + 11:
        raise Garbled(f"FLASER with {n} ranges, 6 numbers, time, host, time was expected")
    return LaserMessage(
        _time(words[n + 8]), _pose(words[n + 5 : n + 8]), _numbers(words[2 : n + 2])
    )


def parse_robotlaser(words: list[bytes]) -> LaserMessage:
    """ROBOTLASER1: seven numbers of the sensor, ranges, remissions, poses of laser and robot, ...

    type start_angle field_of_view resolution max_range accuracy remission_mode n r1..rn m s1..sm
    laser_x laser_y laser_theta x y theta tv rv forward_safety side_safety turn_axis ipc_time host
    logger_time. Raises Garbled.
    """
    n = _count(words, 8)
    m = _count(words, n + 9, at_least=0)
    tail = words[n + 10 + m :]
    if not 13 <= len(tail) <= 14:
        raise Garbled(f"ROBOTLASER1 with {n} ranges, {m} remissions and 14 more was expected")
    start, view, step, max_range = _numbers(words[2:6]).tolist()
    laser, robot = _pose(tail[:3]), _pose(tail[3:6])
    mount = robot.between(laser)
    if not all_within(mount, MAX_MOUNT):
        raise Garbled(f"a laser within {MAX_MOUNT:g} m of the robot was expected")
    return LaserMessage(
        time=_time(tail[11]),
        pose=robot,
        ranges=_numbers(words[9 : n + 9]),
        angles=_fan(n, start, view, step),
        max_range=max_range if 0 < max_range <= MAX_RANGE else None,
        mount=mount,
    )


def parse_param(words: list[bytes]) -> dict[bytes, float]:
    """PARAM name value ...: a setting of the front laser; nothing for any other. Raises Garbled."""
    if len(words) < 3 or words[1] not in PARAMS:
        return {}
    (value,) = _numbers(words[2:3]).tolist()
    low, high = PARAMS[words[1]]
    if not low <= value <= high:
        raise Garbled(f"{words[1].decode()} from {low:g} to {high:g} was expected")
    return {words[1]: value}


@lru_cache(maxsize=64)
def flaser_angles(beams: int, step_deg: float = 0.0) -> Array:
    """(beams,) rad of a FLASER line, by CARMEN's convention.

    180 or 181 beams are 1 degree apart, 360 or 361 half a degree, from -90 degrees on; so 180 beams
    end at +89. 400 or 401 are a quarter apart from -50 degrees on. Any other number is symmetric:
    `step_deg` (the log's PARAM) apart or, where that gives no fan, 180 degrees in all.
    """
    known = FLASER_STEP_DEG.get(beams)
    if known is not None:
        first = -50.0 if beams in (400, 401) else -90.0
        angles = np.radians(first + known * np.arange(beams))
    else:
        span = step_deg * (beams - 1)
        span = span if 0 < span <= 360 else 180.0
        angles = np.radians(np.linspace(-span / 2, span / 2, beams))
    angles.flags.writeable = False
    return angles


@lru_cache(maxsize=64)
def _fan(beams: int, start: float, view: float, step: float) -> Array:
    """(beams,) rad. Where step and field of view differ by more than a beam, the view is right."""
    if not (abs(start) <= math.tau and 0 < view <= math.tau + 0.01):
        raise Garbled("ROBOTLASER1 with angles within a full turn was expected")
    size = abs(step)
    if not (size <= math.tau and abs(size * (beams - 1) - view) <= 1.5 * size):
        step = math.copysign(view / (beams - 1), step)
    angles = start + step * np.arange(beams, dtype=np.float64)
    angles.flags.writeable = False
    return angles


def _count(words: list[bytes], at: int, at_least: int = 2) -> int:
    """The number of readings given by the word `at`; never more than the line has words."""
    try:
        n = int(words[at])
    except (ValueError, IndexError):
        n = -1
    if not at_least <= n <= len(words) - at - 1:
        raise Garbled(f"{words[0].decode()} with as many readings as it announces was expected")
    return n


def _numbers(words: list[bytes]) -> Array:
    try:
        return np.array(words, dtype=np.float64)
    except ValueError:
        raise Garbled("numbers were expected") from None


def _pose(words: list[bytes]) -> Pose2:
    pose = Pose2(*_numbers(words).tolist())
    if not all_within(pose, MAX_COORDINATE):
        raise Garbled("a finite pose was expected")
    return pose


def _time(word: bytes) -> float:
    (time,) = _numbers([word]).tolist()
    if not abs(time) <= MAX_TIME:
        raise Garbled("a finite time stamp was expected")
    return time
