"""The readers of rosbags, made fit for files that may be damaged, or made to harm.

What is packed is unpacked up to a bound; settings of the network, which nobody needs here, are not
parsed where they are unusual; and no file makes a reader run longer, or hold more, than its size
gives reason to.
"""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import quote

import apsw
from rosbags import rosbag1
from rosbags.rosbag1 import reader as rosbag1_reader
from rosbags.rosbag2 import metadata, storage_mcap, storage_sqlite3
from rosbags.rosbag2 import reader as rosbag2_reader

from slam.errors import InputError
from slam.io.bags.unpacking import (
    LARGEST,
    as_it_is,
    unpack_bz2,
    unpack_lz4,
    unpack_zstd,
    unpacking_zstd,
)

LARGEST_METADATA = 1 << 21  # bytes of metadata.yaml
LARGEST_QOS = 1 << 14  # characters of one topic's quality of service
STEPS = 100_000_000  # of SQLite's machine, about a second of them, if it is more than
STEPS_A_BYTE = 20  # steps a byte of the file

rosbag1_reader.decompressors |= {"none": as_it_is, "bz2": unpack_bz2, "lz4": unpack_lz4}
storage_mcap.DECOMPRESSORS |= {
    "": lambda data, _: as_it_is(data),
    "lz4": lambda data, _: unpack_lz4(data),
    "zstd": lambda data, _: unpack_zstd(data),
}
_zstd = SimpleNamespace(open=unpacking_zstd, decompress=unpack_zstd)
rosbag2_reader.zstd = _zstd  # pyright: ignore[reportPrivateImportUsage, reportAttributeAccessIssue]


def _qos(told: Any) -> list[Any]:
    """Those of a topic, none where they are not as ROS writes them: they are not needed."""
    text = str(told) if isinstance(told, str) else ""
    if len(text) > LARGEST_QOS or "&" in text:
        return []
    try:
        return metadata.parse_qos(told)
    except Exception:
        return []


for _module in (rosbag2_reader, storage_mcap, storage_sqlite3):
    _module.parse_qos = _qos  # pyright: ignore[reportAttributeAccessIssue]


class Bag1(rosbag1.Reader):
    """A ROS 1 bag whose index is no larger than the file: chunks may share one that is stored
    once."""

    _indexed = 0

    def read_index_data(self, pos: int, indexes: dict[int, list[rosbag1_reader.IndexData]]) -> None:
        """Of one chunk and one connection."""
        assert self.bio
        start = self.bio.tell()
        super().read_index_data(pos, indexes)
        self._indexed += self.bio.tell() - start
        if self._indexed > self.path.stat().st_size:
            raise InputError("its index is larger than the file")


class Mcap(storage_mcap.McapReader):
    """An MCAP file; without chunks, as `ros2 bag record` writes them fast, in any order."""

    def messages(self, connections: Any, start: int | None = None, stop: int | None = None) -> Any:
        """As they were recorded, if there is no index."""
        if self.chunks:
            return super().messages(connections, start, stop)
        return self.messages_scan(connections, start, stop)


class Sqlite(storage_sqlite3.Sqlite3Reader):
    """An SQLite file of any name, that holds no more than its size, and is asked for so long."""

    def __init__(self, path: Any) -> None:
        super().__init__(Path(quote(str(path))))  # it becomes a part of a URI
        self._size = Path(path).stat().st_size

    def open(self) -> None:
        """Raises InputError for more messages than the file has room for."""
        apsw.connection_hooks.append(self._bound)
        try:
            super().open()
        finally:
            apsw.connection_hooks.remove(self._bound)
        assert self.dbconn
        try:
            held = self.dbconn.execute("SELECT total(length(data)) FROM messages").fetchone()
            if held is None or held[0] > self._size:
                raise InputError("its messages are larger than the file")
        except BaseException:
            self.close()
            raise

    def _bound(self, connection: apsw.Connection) -> None:
        left = [max(STEPS, STEPS_A_BYTE * self._size)]

        def too_long() -> bool:
            left[0] -= 100_000
            return left[0] < 0

        connection.limit(apsw.SQLITE_LIMIT_LENGTH, LARGEST)
        connection.set_progress_handler(too_long, 100_000)


class Folder(rosbag2_reader.DirectoryReader):
    """A ROS 2 bag in a folder."""

    STORAGE_PLUGINS = {"mcap": Mcap, "sqlite3": Sqlite}  # noqa: RUF012

    def open(self) -> None:
        """Raises InputError for what ROS does not write."""
        folder = Path(str(self.path))
        for one in folder.iterdir():
            if not (one.is_file() or one.is_dir()):
                raise InputError(f"{one.name} in it is no file")
        described = folder / "metadata.yaml"
        if described.stat().st_size > LARGEST_METADATA:
            raise InputError("its metadata.yaml is larger than any")
        # a name used over and over again (&name, *name) is how YAML makes much out of little
        if re.search(r"(^|[\s:,\[\-])[&*]\w", described.read_text(errors="replace")):
            raise InputError("its metadata.yaml repeats itself, as ROS writes none")
        super().open()
