"""Scans packed into a few long arrays, for saving."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from slam.errors import InputError
from slam.geometry import Pose2
from slam.io.arrays import floats, numbers
from slam.io.guard import SCAN_BYTES, take
from slam.scan import Scan


def packed_scans(scans: Sequence[Scan]) -> dict[str, np.ndarray]:
    """Scans as arrays by name, without any loss."""
    return {
        "beams": np.array([len(scan.ranges) for scan in scans]),
        "ranges": np.concatenate([scan.ranges for scan in scans]),
        "angles": np.concatenate([scan.angles for scan in scans]),
        "limits": np.array([(scan.max_range, scan.min_range, scan.time) for scan in scans]),
        "mounts": np.array([scan.mount for scan in scans]),
        "beam_times": np.array([scan.beam_time for scan in scans]),
    }


def unpacked_scans(data: dict[str, Any]) -> tuple[Scan, ...]:
    """The scans of such arrays. Raises InputError, KeyError, ValueError or TypeError for
    others."""
    beams = data["beams"]
    count = len(beams)
    take(SCAN_BYTES * count)
    limits, mounts = numbers(data["limits"], (count, 3)), numbers(data["mounts"], (count, 3))
    beam_times = numbers(data.get("beam_times", np.zeros(count)), (count,))  # absent in old files
    if not (beams > 0).all():
        raise InputError("a scan has one beam at least")
    if beams.sum() != len(data["ranges"]):
        raise InputError(f"{beams.sum()} beams are announced, there are {len(data['ranges'])}")
    ends = np.cumsum(beams)[:-1]
    rows = zip(
        np.split(floats(data["ranges"], 1), ends),
        np.split(floats(data["angles"], 1), ends),
        limits.tolist(),
        mounts.tolist(),
        beam_times.tolist(),
        strict=True,
    )
    return tuple(
        Scan(ranges, angles, max_range, min_range, time, Pose2(*mount), beam_time)
        for ranges, angles, (max_range, min_range, time), mount, beam_time in rows
    )
