"""Episodes as CARMEN logs."""

from __future__ import annotations

import gzip
import math
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import IO

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.io.carmen.messages import FLASER_STEP_DEG, flaser_angles
from slam.io.files import AnyPath, replacing
from slam.scan import Scan

RANGE_STEP = 1e-4  # m: ranges are written with four decimals
EVEN_TOLERANCE = 1e-6  # rad: beams this close to an even spread are even


def write_carmen(episode: Episode, path: AnyPath) -> None:
    """Write the scans and the odometry; gzip where `path` ends in .gz. Raises InputError.

    FLASER where every scan has the beams of that message's convention, the same maximum range and
    the laser at the robot's centre; otherwise ROBOTLASER1, which needs evenly spaced beams. No echo
    is written as the maximum range, no reading as 0. Ranges keep 0.1 mm, poses and stamps six
    decimals. The truth, which a CARMEN log cannot hold, is left out.
    """
    plain = all(_fits_flaser(scan, episode.scans[0].max_range) for scan in episode.scans)
    packed = Path(path).suffix == ".gz"
    with replacing(path) as file, _compressed(file) if packed else nullcontext(file) as out:
        for line in _lines(episode, plain):
            out.write(line.encode() + b"\n")


def _compressed(file: IO[bytes]) -> gzip.GzipFile:
    """With no name and no time in its header: the same episode gives the same bytes."""
    return gzip.GzipFile("", "wb", compresslevel=6, fileobj=file, mtime=0)


def _fits_flaser(scan: Scan, max_range: float) -> bool:
    beams = len(scan.ranges)
    return (
        beams in FLASER_STEP_DEG
        and np.allclose(scan.angles, flaser_angles(beams), rtol=0, atol=EVEN_TOLERANCE)
        and scan.mount == Pose2()
        and scan.max_range == max_range
    )


def _lines(episode: Episode, plain: bool) -> Iterator[str]:
    yield "# CARMEN log written by dynslam"
    if plain:
        yield f"PARAM robot_front_laser_max {float(episode.scans[0].max_range)!r}"
    odometry = episode.odometry
    start = float(odometry.times[0])
    # Both are interpolated: a scan and a pose of the same time are written alike, and read as one.
    at_poses, at_scans = odometry.at(odometry.times), odometry.at(episode.times)
    events = [(time, 0, k) for k, time in enumerate(odometry.times.tolist())]
    events += [(time, 1, k) for k, time in enumerate(episode.times.tolist())]
    for time, kind, k in sorted(events):
        stamp = f"{time:.6f} dynslam {time - start:.6f}"
        if kind == 0:
            yield f"ODOM {_six(at_poses[k])} 0 0 0 {stamp}"
        elif plain:
            yield f"{_flaser(episode.scans[k], at_scans[k])} {stamp}"
        else:
            yield f"{_robotlaser(episode.scans[k], at_scans[k])} {stamp}"


def _flaser(scan: Scan, pose: Array) -> str:
    return f"FLASER {len(scan.ranges)} {_ranges(scan)} {_six(pose)} {_six(pose)}"


def _robotlaser(scan: Scan, pose: Array) -> str:
    beams = len(scan.ranges)
    step = (scan.angles[-1] - scan.angles[0]) / (beams - 1) if beams > 1 else 0.0
    if beams < 2 or not np.allclose(np.diff(scan.angles), step, rtol=0, atol=EVEN_TOLERANCE):
        raise InputError(
            f"a CARMEN log needs two or more evenly spaced beams, "
            f"but those of the scan at {scan.time:.6f} s are not"
        )
    laser = Pose2.of(pose) @ scan.mount
    sensor = (
        f"0 {scan.angles[0]:.9f} {abs(step) * (beams - 1):.9f} {step:.12f} "
        f"{float(scan.max_range)!r} 0 0"
    )
    return (
        f"ROBOTLASER1 {sensor} {beams} {_ranges(scan)} 0 "
        f"{_six(np.array(laser))} {_six(pose)} 0 0 0 0 0"
    )


def _ranges(scan: Scan) -> str:
    hits = np.minimum(
        scan.ranges, scan.max_range - RANGE_STEP
    )  # rounding must not make it "no echo"
    no_echo = math.ceil(scan.max_range / RANGE_STEP) * RANGE_STEP
    written = np.where(scan.no_echo, no_echo, np.where(scan.hit, hits, 0.0))
    return " ".join(["%.4f"] * len(written)) % tuple(written.tolist())


def _six(pose: Array) -> str:
    return " ".join(f"{value:.6f}" for value in pose.tolist())
