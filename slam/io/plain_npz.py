"""Scans as plain numpy arrays in an .npz file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.io.arrays import UNREADABLE, floats, read_arrays
from slam.io.files import AnyPath
from slam.io.guard import SCAN_BYTES, guarded, take
from slam.io.loaded_recording import LoadedRecording
from slam.io.max_range import estimated_max_range
from slam.io.one_line import one_line
from slam.scan import Scan
from slam.trajectory import Trajectory

LAYOUT = (
    "times (n,) s, ranges (n, beams) m, angles (beams,) rad; optional: poses (n, 3), or "
    "odometry_times (m,), odometry_poses (m, 3); range_min, range_max, mount (3,), beam_time"
)


def read_plain_npz(path: AnyPath) -> LoadedRecording:
    """Read arrays of the `LAYOUT`; ranges as in `Scan`, poses are the odometry.

    Without `range_max`, it is guessed from the readings. Raises InputError for anything else.
    """
    with guarded(path):
        return _read(path)


def _read(path: AnyPath) -> LoadedRecording:
    data = read_arrays(path, "arrays of scans")
    missing = [name for name in ("times", "ranges", "angles") if name not in data]
    if missing:
        raise InputError(f"no array {', '.join(missing)}; expected {LAYOUT}")
    try:
        return _log(data, Path(path).name)
    except UNREADABLE as error:
        raise InputError(f"{one_line(error, 150)}; expected {LAYOUT}") from None


def _log(data: dict[str, Any], source: str) -> LoadedRecording:
    times, angles = floats(data["times"], 1), floats(data["angles"], 1)
    take(SCAN_BYTES * len(times))
    ranges = floats(data["ranges"], 2)
    if ranges.shape != (len(times), len(angles)) or not len(angles):
        raise InputError(
            f"ranges have shape {ranges.shape} for {len(times)} times and {len(angles)} angles"
        )
    high = _scalar(data, "range_max") or estimated_max_range(list(ranges))
    low, beam_time = _scalar(data, "range_min"), _scalar(data, "beam_time")
    mount = Pose2.of(floats(data.get("mount", np.zeros(3)), 1))
    scans = tuple(
        Scan(row, angles, high, low, time, mount, beam_time)
        for row, time in zip(ranges, times.tolist(), strict=True)
    )
    odometry, origin = Trajectory(times, np.zeros((len(times), 3))), ""
    if "poses" in data:
        odometry, origin = Trajectory(times, floats(data["poses"], 2)), "poses"
    elif "odometry_poses" in data:
        if "odometry_times" not in data:
            raise InputError("odometry_poses without odometry_times")
        at = floats(data["odometry_times"], 1)
        odometry, origin = Trajectory(at, floats(data["odometry_poses"], 2)), "odometry_poses"
    return LoadedRecording(
        Episode(scans, odometry, meta={"source": source, "odometry": origin}), ()
    )


def _scalar(data: dict[str, Any], name: str) -> float:
    """A number by its name, 0 if there is none."""
    value = float(floats(data.get(name, 0.0), 0))
    if not math.isfinite(value):
        raise InputError(f"{name} must be finite, got {value}")
    return value
