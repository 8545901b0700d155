"""Small ROS recordings of our own making, message by message."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin

from slam.geometry import Pose2
from slam.io.bags import read_bag
from slam.io.bags.bag_writer import BagWriter, new_bag
from slam.io.loaded_recording import LoadedRecording, SourceSelection

LASER, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
UPRIGHT, UPSIDE_DOWN = (0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0)  # quaternions x, y, z, w


class Said(NamedTuple):
    """One message, as recorded at a time."""

    topic: str
    received: float
    build: Callable[[BagWriter], Any]


def typed(out: BagWriter, kind: str, **fields: Any) -> Any:
    return out._store.types[kind](**fields)


def scan(
    time: float,
    ranges: Iterable[float] = (1.0, 2.0, 3.0),
    fan: tuple[float, float] = (-0.5, 0.5),
    *,
    last: float | None = None,
    reach: tuple[float, float] = (0.1, 10.0),
    frame: str = "laser",
    stamp: float | None = None,
    topic: str = "/scan",
    beam_time: float = 0.0,
) -> Said:
    """A LaserScan; fan: the first angle and the step, rad."""
    values = np.array(list(ranges), dtype=np.float32)
    end = fan[0] + fan[1] * (len(values) - 1) if last is None else last

    def build(out: BagWriter) -> Any:
        header = out.make.header(time if stamp is None else stamp, frame)
        return typed(
            out, LASER, header=header, angle_min=fan[0], angle_max=end, angle_increment=fan[1],
            time_increment=beam_time, scan_time=0.0, range_min=reach[0], range_max=reach[1],
            ranges=values, intensities=np.zeros(0, np.float32),
        )  # fmt: skip

    return Said(topic, time, build)


def odom(
    time: float,
    x: float = 0.0,
    *,
    y: float = 0.0,
    turn: tuple[float, ...] = UPRIGHT,
    topic: str = "/odom",
    child: str = "base_link",
    stamp: float | None = None,
) -> Said:
    """A nav_msgs/Odometry."""

    def build(out: BagWriter) -> Any:
        told = time if stamp is None else stamp
        message = out.make.odometry(told, "odom", child, Pose2(x, y, 0.0))
        message.pose.pose.orientation = quaternion(out, turn)
        return message

    return Said(topic, time, build)


def frame(
    time: float,
    parent: str,
    child: str,
    place: tuple[float, float, float] = (0.0, 0.0, 0.0),
    turn: tuple[float, ...] = UPRIGHT,
    *,
    topic: str = "/tf",
    stamp: float | None = None,
) -> Said:
    """A TFMessage of one transform."""

    def build(out: BagWriter) -> Any:
        message = out.make.transform(time if stamp is None else stamp, parent, child, Pose2())
        transform = message.transforms[0].transform
        transform.translation.x, transform.translation.y, transform.translation.z = place
        transform.rotation = quaternion(out, turn)
        return message

    return Said(topic, time, build)


def static(child: str, *args: Any, parent: str = "base_link", **options: Any) -> Said:
    return frame(1.0, parent, child, *args, topic="/tf_static", **options)


def quaternion(out: BagWriter, turn: tuple[float, ...]) -> Any:
    x, y, z, w = turn
    return typed(out, "geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


def yawed(angle: float) -> tuple[float, float, float, float]:
    return (0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2))


def drive(scans: int = 5) -> list[Said]:
    """Odometry every 0.1 s, 0.1 m each; a scan every 0.2 s; a laser 0.3 m ahead of the centre."""
    said = [static("laser", (0.3, 0.0, 0.2))]
    said += [odom(1 + 0.1 * k, 0.1 * k) for k in range(2 * scans + 1)]
    return said + [scan(1.05 + 0.2 * k) for k in range(scans)]


def write(path: Path, said: Iterable[Said]) -> Path:
    """.bag, .mcap, .db3, or a folder."""
    with new_bag(path) as out:
        _put(out, said)
    return path


def write_packed(path: Path, said: Iterable[Said], packing: str) -> Path:
    """Packed by bz2 or lz4 (.bag); or of a folder the chunks, or each message or file."""
    if packing in ("bz2", "lz4"):
        writer = rosbag1.Writer(path)
        writer.set_compression(rosbag1.Writer.CompressionFormat[packing.upper()])
        with writer:
            _put(BagWriter(writer), said)
        return path
    plugin, _, mode = packing.partition(" ")
    folder = rosbag2.Writer(path, version=8, storage_plugin=StoragePlugin[plugin.upper()])
    folder.set_compression(CompressionMode[mode.upper()], CompressionFormat.ZSTD)
    with folder:
        _put(BagWriter(folder), said)
    return path


def _put(out: BagWriter, said: Iterable[Said]) -> None:
    for topic, received, build in sorted(said, key=lambda one: one.received):
        out.put(topic, received, build(out))


def read(
    tmp_path: Path, said: Iterable[Said], choice: SourceSelection = SourceSelection()
) -> LoadedRecording:
    """Through a ROS 1 bag."""
    return read_bag(write(tmp_path / "some.bag", said), choice)


def told(log: LoadedRecording) -> str:
    return "; ".join(map(str, log.warnings))
