"""CARMEN logs: a text file of ODOM and laser lines becomes an Episode.

What cannot be used is left out and counted in `warnings`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array
from slam.io.carmen.messages import LaserMessage, Odom, flaser_angles
from slam.io.carmen.parser import CarmenParser
from slam.io.files import AnyPath, CutShortError, lines
from slam.io.guard import guarded
from slam.io.loaded_recording import LoadedRecording
from slam.io.max_range import estimated_max_range
from slam.io.monotonic_times import monotonic
from slam.scan import Scan
from slam.trajectory import Trajectory

EXPECTED = (
    "of a file that is no bag, .npz or table, a CARMEN log with FLASER or ROBOTLASER1 lines "
    "was expected"
)


def read_carmen(path: AnyPath) -> LoadedRecording:
    """Read a CARMEN log, plain or gzip. Raises InputError if there is no usable scan in it.

    The laser is that of FLASER or of ROBOTLASER1, whichever comes first; other messages are left
    out. The odometry holds all ODOM poses and the scans' own ones, in file order. Times are the
    log's ipc stamps; those that do not increase are moved (`monotonic`). A line whose pose is an
    outlier (`outliers`) is left out.

    FLASER angles follow `flaser_angles`; its laser stands on the robot where the log's PARAM lines
    say, or at its centre. A reading at or above the sensor's maximum range becomes `inf`, no echo:
    the maximum is the line's own, or the log's PARAM, or `estimated_max_range`. A negative or
    unreadable range becomes NaN, no reading.
    """
    with guarded(path):
        return _read(path)


def _read(path: AnyPath) -> LoadedRecording:
    log = _parsed(path)
    times = _times(log)
    meta = {"source": Path(path).name}
    episode = Episode(_scans(log, times), _odometry(log.messages, times), meta=meta)
    return LoadedRecording(episode, log.warnings.counted())


def _parsed(path: AnyPath) -> CarmenParser:
    log = CarmenParser()
    number = 0
    try:
        for number, line in lines(path):
            log.take(number, line)
    except CutShortError:
        if not log.lasers:
            raise
        log.warnings.add("file damaged or cut short, the part before used", number)
    log.leave_out_outliers()
    if not number:
        raise InputError(f"{path}: empty; {EXPECTED}")
    if not log.lasers:
        why = f":{log.reason}" if log.reason else f": no scan in {number} lines; {EXPECTED}"
        raise InputError(f"{path}{why}")
    return log


def _times(log: CarmenParser) -> Array:
    """(messages,) s, increasing, but for a scan and an ODOM line of the same moment and pose."""
    joined = [False] * len(log.messages)
    for k, (a, b) in enumerate(zip(log.messages, log.messages[1:], strict=False), start=1):
        joined[k] = a[:2] == b[:2] and type(a) is not type(b) and not joined[k - 1]
    return monotonic(
        np.array([message.time for message in log.messages]),
        np.array(joined),
        lambda at, kind: log.warnings.add(kind, log.numbers[at]),
    )


def _odometry(messages: list[Odom | LaserMessage], times: Array) -> Trajectory:
    new = np.concatenate([[True], np.diff(times) > 0])
    poses = np.array([message.pose for message in messages])
    return Trajectory(times[new], poses[new])


def _scans(log: CarmenParser, times: Array) -> tuple[Scan, ...]:
    lasers = log.lasers
    stated = log.param(b"robot_front_laser_max") or log.param(b"laser_front_laser_max")
    max_range = stated if stated > 0 else estimated_max_range([laser.ranges for laser in lasers])
    step_deg = log.param(b"laser_front_laser_resolution")
    at = [k for k, message in enumerate(log.messages) if isinstance(message, LaserMessage)]
    scans = []
    for laser, time in zip(lasers, times[at].tolist(), strict=True):
        limit = laser.max_range or max_range
        angles = laser.angles
        if angles is None:
            angles = flaser_angles(len(laser.ranges), step_deg)
        mount = log.mount if laser.mount is None else laser.mount
        scans.append(Scan(_readings(laser.ranges, limit), angles, limit, time=time, mount=mount))
    return tuple(scans)


def _readings(ranges: Array, max_range: float) -> Array:
    """Ranges as a `Scan` has them: no echo is inf, no reading NaN."""
    return np.where(ranges >= max_range, np.inf, np.where(ranges >= 0, ranges, np.nan))
