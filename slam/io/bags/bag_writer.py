"""Write ROS messages: to a ROS 1 bag, or a ROS 2 bag as a folder, .mcap or .db3."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rosbags import rosbag1, rosbag2
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin

from slam.episode import Episode
from slam.errors import InputError
from slam.io.bags.bag import ROS1, ROS2
from slam.io.bags.message_factory import MessageFactory
from slam.io.files import AnyPath
from slam.io.leftovers import temporary_folder

FOREVER = QosTime(9_223_372_036, 854_775_807)
LATCHED = Qos(
    QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, FOREVER,
    FOREVER, QosLiveliness.AUTOMATIC, FOREVER, avoid_ros_namespace_conventions=False,
)  # fmt: skip
"""Latched, as tf2 requires for /tf_static and rviz for a map: later subscribers receive it."""
KEPT = ("/tf_static", "/map")
LATEST = 2.0**31 - 1  # s: maximum stamp of ROS 2; that of ROS 1 is twice as large


class BagWriter:
    """A recording open for writing.

    make  makes messages of its ROS version
    """

    def __init__(self, writer: rosbag1.Writer | rosbag2.Writer):
        self._writer = writer
        self._store = ROS1 if isinstance(writer, rosbag1.Writer) else ROS2
        self._connections: dict[str, Connection] = {}
        self.make = MessageFactory(self._store)

    def put(self, topic: str, time: float, message: Any) -> None:
        """Write a message, recorded at `time`, s."""
        kind = message.__msgtype__
        writer, store = self._writer, self._store
        nanoseconds = round(time * 1e9)
        if isinstance(writer, rosbag1.Writer):
            if topic not in self._connections:
                latching = 1 if topic in KEPT else None
                self._connections[topic] = writer.add_connection(
                    topic, kind, typestore=store, latching=latching
                )
            data = bytes(store.serialize_ros1(message, kind))
            writer.write(self._connections[topic], nanoseconds, data)
        else:
            if topic not in self._connections:
                profiles = [LATCHED] if topic in KEPT else []
                self._connections[topic] = writer.add_connection(
                    topic, kind, typestore=store, offered_qos_profiles=profiles
                )
            data = store.serialize_cdr(message, kind)
            writer.write(self._connections[topic], nanoseconds, data)


def check_times(episode: Episode) -> None:
    """Raise InputError for stamps that a ROS message cannot hold."""
    for times in (episode.times, episode.odometry.times):
        if not 0 <= times.min() <= times.max() < LATEST:
            raise InputError("a bag needs times from 0 to 2**31 s")


@contextmanager
def new_bag(path: AnyPath) -> Iterator[BagWriter]:
    """A new recording at `path`, created atomically when complete: .bag is ROS 1, .mcap and .db3
    one file of ROS 2, no ending a folder of ROS 2. A folder that holds the same bag, of a run that
    was killed, is kept. Raises InputError if it cannot be written, or holds anything else."""
    path = Path(path)
    is_bag = not path.suffix and (path / "metadata.yaml").is_file()
    if not is_bag and (path.is_dir() or (path.exists() and not path.suffix)):
        raise _there_already(path)
    try:
        with temporary_folder(path) as temporary:
            made = temporary / path.name  # the file in a folder is named after it
            if path.suffix == ".bag":
                with rosbag1.Writer(made) as writer:
                    yield BagWriter(writer)
                made.replace(path)
            else:
                plugin = StoragePlugin.SQLITE3 if path.suffix == ".db3" else StoragePlugin.MCAP
                writer = rosbag2.Writer(made, version=8, storage_plugin=plugin)
                if plugin == StoragePlugin.MCAP:  # its chunks, as ROS itself does
                    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
                with writer:
                    yield BagWriter(writer)
                if path.suffix:
                    next(one for one in made.iterdir() if one.suffix == path.suffix).replace(path)
                else:
                    _place_folder(made, path)
    except (OSError, rosbag1.WriterError, rosbag2.WriterError) as error:
        raise InputError(
            f"{path}: cannot be written ({getattr(error, 'strerror', None) or error})"
        ) from None


def _place_folder(made: Path, path: Path) -> None:
    """Raises InputError where another recording is there already."""
    try:
        made.replace(path)
    except OSError:
        if not path.is_dir():
            raise
        if _contents(made) != _contents(path):
            raise _there_already(path) from None


def _contents(folder: Path) -> dict[str, bytes]:
    return {one.name: one.read_bytes() for one in folder.iterdir()}


def _there_already(path: Path) -> InputError:
    return InputError(f"{path}: is there already; a bag is written into a new folder")
