"""A small valid file for every reader, to be damaged."""

from __future__ import annotations

import gzip
import io
import math
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np

from slam.episode import Episode, Truth
from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.io.formats import read_log, write_log
from slam.io.relations import read_relations
from slam.io.ros_map import read_ros_map, write_ros_map
from slam.io.tum import read_tum, write_tum
from slam.scan import Scan
from slam.trajectory import Trajectory


def small_drive(scans: int = 3, beams: int = 4, truth: bool = False) -> Episode:
    """A straight drive with every kind of reading."""
    angles = np.linspace(-1.0, 1.0, beams)
    ranges = np.resize([1.5, 2.25, math.inf, math.nan], beams)
    made = tuple(
        Scan(ranges, angles, 8.0, 0.25, 1.0 + 0.5 * k, Pose2(0.25, 0.0, 0.125))
        for k in range(scans)
    )
    times = np.arange(1.0, 1.0 + 0.5 * scans, 0.25)
    poses = np.column_stack([0.1 * times, 0.0 * times, 0.05 * times])
    known = Truth(poses[::2][:scans], np.zeros((1, 4)), np.zeros((scans, 1, 4)))
    return Episode(made, Trajectory(times, poses), known if truth else None, {"seed": 1})


def _written(ending: str, drive: Episode) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"drive{ending}"
        write_log(drive, path)
        return path.read_bytes()


def _plain_npz() -> bytes:
    file = io.BytesIO()
    np.savez(
        file, times=[1.0, 2.0], ranges=np.ones((2, 3)), angles=[0.0, 0.1, 0.2],
        poses=np.zeros((2, 3)), range_max=9.0,
    )  # fmt: skip
    return file.getvalue()


def _flaser() -> bytes:
    ranges = " ".join(["2.5"] * 180)
    return "".join(
        f"ODOM {k} 0 0 0 0 0 {k} h {k}\nFLASER 180 {ranges} {k} 0 0 {k} 0 0 {k} h {k}\n"
        for k in range(3)
    ).encode()


def _tum() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write_tum(small_drive().odometry, Path(folder) / "some.tum")
        return (Path(folder) / "some.tum").read_bytes()


def _map(ending: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        spec = GridSpec(0.5, -2, 1, 3, 4)
        cells = np.arange(12.0).reshape(3, 4) % 3 / 2
        write_ros_map(OccupancyGrid(spec, cells, cells != 0.5), Path(folder) / "map")
        return (Path(folder) / f"map{ending}").read_bytes()


@lru_cache(maxsize=1)
def samples() -> dict[str, bytes]:
    """Contents by file name."""
    drive = small_drive()
    return {
        "flaser.log": _flaser(),
        "robotlaser.log": _written(".log", drive),
        "packed.log.gz": gzip.compress(_flaser(), mtime=0),
        "table.csv": _written(".csv", drive),
        "episode.npz": _written(".npz", small_drive(truth=True)),
        "plain.npz": _plain_npz(),
        "ros1.bag": _written(".bag", drive),
        "ros2.mcap": _written(".mcap", drive),
        "ros2.db3": _written(".db3", drive),
        "some.tum": _tum(),
        "some.relations": b"1 2 0.5 0 0 0 0 0.1\n2 3 0.5 0 0 0 0 0.1\n",
        "map.yaml": _map(".yaml"),
        "map.pgm": _map(".pgm"),
    }


def reader_of(name: str) -> Callable[[Path], object]:
    """What reads a file of this name; a map's picture is read through its YAML beside it."""
    if name == "map.pgm":
        return lambda path: read_ros_map(path.with_suffix(".yaml"))
    other = {".tum": read_tum, ".relations": read_relations, ".yaml": read_ros_map}
    return other.get(Path(name).suffix, read_log)
