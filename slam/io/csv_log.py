"""Scans as a table of comma-separated values, one row a scan.

    # angle_min: -1.5707963
    # angle_increment: 0.0174533
    # range_max: 30
    time,x,y,theta,r0,r1,r2
    0.0,0,0,0,2.51,2.50,inf

`time` in s; `x`, `y` (m), `theta` (rad): the odometry, all three or none; all other columns are
ranges in m, in the order of the beams: inf is no echo, empty or nan no reading. A row without any
range holds an odometry pose alone. Lines of the head are `# name: value`: angle_min and
angle_increment (rad; needed), range_max (m; estimated if missing), range_min (m), mount (x y theta
of the laser on the robot), beam_time (s from a beam to the next).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from slam.bounds import MAX_ANGLE
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.io.constant_mount import constant_mount
from slam.io.files import MAX_LINE, AnyPath, lines, replacing
from slam.io.guard import SCAN_BYTES, guarded, take
from slam.io.loaded_recording import LoadedRecording
from slam.io.max_range import estimated_max_range
from slam.scan import Scan
from slam.trajectory import Trajectory

POSE = ["x", "y", "theta"]
HEAD = {
    "angle_min": 1,
    "angle_increment": 1,
    "range_min": 1,
    "range_max": 1,
    "mount": 3,
    "beam_time": 1,
}
EVEN_TOLERANCE = 1e-6  # rad: beams this close to an even spread are even
COPIES = 3  # of a row: as it is read, in the table, and what is computed from it


def read_csv(path: AnyPath) -> LoadedRecording:
    """Read a table of the layout above. Raises InputError with the line that is wrong."""
    with guarded(path):
        return _read(path)


def _read(path: AnyPath) -> LoadedRecording:
    head: dict[str, list[float]] = {}
    columns: list[str] = []
    rows: list[Array] = []
    for number, line in lines(path):
        text = line.decode(
            "utf-8-sig", errors="replace"
        ).strip()  # spreadsheets write a byte order mark
        where = f"{path}:{number}"
        if len(line) >= MAX_LINE:
            raise InputError(f"{where}: a line of over {MAX_LINE >> 20} MB, as no scan needs")
        if text.startswith("#"):
            _take_head(head, text[1:], where)
        elif text and not columns:
            columns = _columns(text, where)
        elif text:
            rows.append(_row(text, len(columns), where))
            take(COPIES * rows[-1].nbytes + SCAN_BYTES)
            if len(rows) > 1 and not rows[-1][0] > rows[-2][0]:
                raise InputError(f"{where}: expected a later time than in the row before")
    if not rows:
        raise InputError(f"{path}: no row of numbers in it; expected a line of names and rows")
    return _log(Path(path).name, head, columns, np.array(rows))


def write_csv(episode: Episode, path: AnyPath) -> None:
    """Write the layout above. Raises InputError where beams are uneven, or not always the same, or
    the laser moves on the robot; the truth is left out, and so is a scan without any reading."""
    first = episode.scans[0]
    angles = first.angles
    if not len(angles):
        raise InputError("a table needs scans with beams")
    step = float(angles[-1] - angles[0]) / max(len(angles) - 1, 1)
    even = angles[0] + step * np.arange(len(angles))
    for scan in episode.scans:
        if scan.angles.shape != even.shape or np.abs(scan.angles - even).max() > EVEN_TOLERANCE:
            raise InputError("a table needs beams that are evenly spread and always the same")
        if _laser(scan) != _laser(first):
            raise InputError("a table needs a laser that is always the same")
    constant_mount(episode)
    with replacing(path) as file:
        for line in _lines(episode, float(angles[0]), step):
            file.write(line.encode() + b"\n")


def _laser(scan: Scan) -> tuple[float, float, float]:
    return scan.min_range, scan.max_range, scan.beam_time


def _take_head(head: dict[str, list[float]], text: str, where: str) -> None:
    name, colon, value = text.partition(":")
    name = name.strip()
    if not colon or name not in HEAD:
        return
    numbers = [_number(word) for word in value.replace(",", " ").split()]
    if len(numbers) != HEAD[name] or not all(map(math.isfinite, numbers)):
        raise InputError(f"{where}: expected {HEAD[name]} finite number(s) for {name}")
    head[name] = numbers


def _columns(text: str, where: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if names[0] != "time" or (set(POSE) & set(names) and names[1:4] != POSE):
        raise InputError(f"{where}: expected names `time,r0,...` or `time,x,y,theta,r0,...`")
    if len(names) < 2 + 3 * ("x" in names):
        raise InputError(f"{where}: expected columns of ranges after the pose, there are none")
    return names


def _row(text: str, width: int, where: str) -> Array:
    words = text.split(",")
    if len(words) != width:
        raise InputError(f"{where}: expected {width} columns, got {len(words)}")
    try:
        row = np.array([word.strip() or "nan" for word in words], dtype=np.float64)
    except ValueError:
        raise InputError(f"{where}: expected numbers, got {text[:60]!r}") from None
    if not math.isfinite(row[0]):
        raise InputError(f"{where}: expected a finite time, got {words[0][:60]!r}")
    return row


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan


def _log(
    source: str, head: dict[str, list[float]], columns: list[str], rows: Array
) -> LoadedRecording:
    for name in ("angle_min", "angle_increment"):
        if name not in head:
            raise InputError(f"expected a line `# {name}: ...` in the head, there is none")
    posed = "x" in columns
    times, ranges = rows[:, 0], rows[:, 1 + 3 * posed :]
    seen = ~np.isnan(ranges).all(axis=1)
    if not seen.any():
        raise InputError("no row with a range in it")
    first, step = head["angle_min"][0], head["angle_increment"][0]
    if max(abs(first), abs(step)) > MAX_ANGLE:
        raise InputError(f"expected angles in rad, got {first:g} and steps of {step:g}")
    angles = first + step * np.arange(ranges.shape[1])
    high = head["range_max"][0] if "range_max" in head else estimated_max_range(list(ranges[seen]))
    low = head.get("range_min", [0.0])[0]
    mount = Pose2(*head.get("mount", [0.0, 0.0, 0.0]))
    beam_time = head.get("beam_time", [0.0])[0]
    scans = tuple(
        Scan(row, angles, high, low, time, mount, beam_time)
        for row, time in zip(ranges[seen], times[seen].tolist(), strict=True)
    )
    if posed:
        told = np.isfinite(rows[:, 1:4]).all(axis=1)
        if not told.any():
            raise InputError("no row with a finite x, y, theta")
        odometry = Trajectory(times[told], rows[told, 1:4])
    else:
        odometry = Trajectory(times[seen], np.zeros((len(scans), 3)))
    meta = {"source": source, "odometry": "x, y, theta" if posed else ""}
    return LoadedRecording(Episode(scans, odometry, meta=meta), ())


def _lines(episode: Episode, first: float, step: float) -> Iterator[str]:
    scan = episode.scans[0]
    yield f"# angle_min: {first!r}"
    yield f"# angle_increment: {step!r}"
    yield f"# range_min: {float(scan.min_range)!r}"
    yield f"# range_max: {float(scan.max_range)!r}"
    yield "# mount: " + " ".join(repr(float(value)) for value in scan.mount)
    yield f"# beam_time: {float(scan.beam_time)!r}"
    beams = len(scan.ranges)
    posed = episode.has_odometry
    yield ",".join(["time", *(POSE if posed else []), *(f"r{k}" for k in range(beams))])
    if not posed:
        yield from (f"{float(scan.time)!r},{_cells(scan)}" for scan in episode.scans)
        return
    odometry = episode.odometry
    alone = np.setdiff1d(odometry.times, episode.times)
    times = np.concatenate([episode.times, alone])
    poses = odometry.at(times)
    none = "," * (beams - 1)
    for k in np.argsort(times, kind="stable").tolist():
        x, y, theta = poses[k].tolist()
        ranges = _cells(episode.scans[k]) if k < len(episode.scans) else none
        yield f"{float(times[k])!r},{x:.9g},{y:.9g},{theta:.9g},{ranges}"


def _cells(scan: Scan) -> str:
    """Six digits, or all of them if rounding would turn an echo into no echo or no reading."""
    ranges = np.where(scan.no_echo, np.inf, np.where(scan.hit, scan.ranges, np.nan))
    texts = [f"{value:.6g}" if value == value else "" for value in ranges.tolist()]
    low, high = scan.min_range, scan.max_range
    for k in np.flatnonzero(scan.hit & ((ranges < 1.00001 * low) | (ranges > 0.99999 * high))):
        texts[k] = repr(float(ranges[k]))
    return ",".join(texts)
