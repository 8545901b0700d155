"""The readers of rosbags, hardened against files that are damaged or malicious.

Decompression is bounded, unusual quality-of-service settings are not parsed (they are not needed
here), and the time and memory of a reader are bounded by the size of its file.
"""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from urllib.parse import quote

import apsw
from rosbags import rosbag1
from rosbags.rosbag1 import reader as rosbag1_reader
from rosbags.rosbag2 import metadata, storage_mcap, storage_sqlite3
from rosbags.rosbag2 import reader as rosbag2_reader

from slam.errors import InputError
from slam.io.bags.decompression import (
    MAX_CHUNK,
    decompress_bz2,
    decompress_lz4,
    decompress_zstd,
    open_zstd,
    uncompressed,
)
from slam.io.guard import RECORD_BYTES, take

MAX_METADATA = 1 << 21  # bytes of metadata.yaml
MAX_QOS = 1 << 14  # characters of one topic's quality of service
MIN_STEP_LIMIT = 100_000_000  # of SQLite's virtual machine, about a second, if more than
STEPS_PER_BYTE = 20  # of the file
MIN_VALUE = 1 << 20  # bytes of one value, or of a statement, that any file may have
READ_TABLES = ("topics", "message_definitions", "messages")

rosbag1_reader.decompressors |= {"none": uncompressed, "bz2": decompress_bz2, "lz4": decompress_lz4}
storage_mcap.DECOMPRESSORS |= {
    "": lambda data, _: uncompressed(data),
    "lz4": lambda data, _: decompress_lz4(data),
    "zstd": lambda data, _: decompress_zstd(data),
}
_zstd = SimpleNamespace(open=open_zstd, decompress=decompress_zstd)
rosbag2_reader.zstd = _zstd  # pyright: ignore[reportPrivateImportUsage, reportAttributeAccessIssue]


def _qos(text_or_list: Any) -> list[Any]:
    """QoS settings of a topic, not needed here; none if they are not in the format of ROS."""
    text = str(text_or_list) if isinstance(text_or_list, str) else ""
    if len(text) > MAX_QOS or "&" in text:
        return []
    try:
        return metadata.parse_qos(text_or_list)
    except Exception:
        return []


for _module in (rosbag2_reader, storage_mcap, storage_sqlite3):
    _module.parse_qos = _qos  # pyright: ignore[reportAttributeAccessIssue]


class Bag1(rosbag1.Reader):
    """A ROS 1 bag whose index, as it is read, is no larger than the file: several chunks could
    point to the same stored index."""

    _indexed = 0

    def read_index_data(self, pos: int, indexes: dict[int, list[rosbag1_reader.IndexData]]) -> None:
        """Read the index of one chunk and one connection. Raises InputError."""
        assert self.bio
        start = self.bio.tell()
        super().read_index_data(pos, indexes)
        self._indexed += self.bio.tell() - start
        if self._indexed > self.path.stat().st_size:
            raise InputError("its index is larger than the file")


class Mcap(storage_mcap.McapReader):
    """An MCAP file; one without chunks, which `ros2 bag record` can write, has no order."""

    def messages(self, connections: Any, start: int | None = None, stop: int | None = None) -> Any:
        """The messages in order of time, or in order of the file where there is no index."""
        if self.chunks:
            return super().messages(connections, start, stop)
        return self.messages_scan(connections, start, stop)


class Sqlite(storage_sqlite3.Sqlite3Reader):
    """An SQLite file of any name; the size of its content and the time of queries are bounded.

    A column can have a default of a megabyte in each row, or be computed where it is read: a file
    can hold far more than its bytes.
    """

    def __init__(self, path: Any) -> None:
        super().__init__(Path(quote(str(path))))  # rosbags puts it into a URI
        self._size = Path(path).stat().st_size

    def open(self) -> None:
        """Raises InputError for more content than the file has room for."""
        apsw.connection_hooks.append(self._bound)
        try:
            super().open()
        finally:
            apsw.connection_hooks.remove(self._bound)

    def _bound(self, connection: apsw.Connection) -> None:
        left = [max(MIN_STEP_LIMIT, STEPS_PER_BYTE * self._size)]

        def too_long() -> bool:
            left[0] -= 100_000
            return left[0] < 0

        longest = min(MAX_CHUNK, max(MIN_VALUE, self._size))
        connection.limit(apsw.SQLITE_LIMIT_LENGTH, longest)
        connection.set_progress_handler(too_long, 100_000)
        if sum(_content(connection, table) for table in READ_TABLES) > self._size:
            raise InputError("its messages are larger than the file")


def _content(connection: apsw.Connection, table: str) -> float:
    """Bytes of all values of a table, one that there is not has none; its rows are taken from the
    budget of the file."""
    names = [row[1] for row in connection.execute(f"PRAGMA table_xinfo({table})")]
    if not names:
        return 0.0
    quoted = (str(name).replace('"', '""') for name in names)
    columns = " + ".join(f'total(octet_length("{name}"))' for name in quoted)
    counted = connection.execute(f"SELECT count(*), {columns} FROM {table}").fetchall()
    rows, size = cast(tuple[int, float], counted[0])
    if table != "messages":  # these are counted one by one
        take(RECORD_BYTES * rows)
    return size


class Folder(rosbag2_reader.DirectoryReader):
    """A ROS 2 bag in a folder."""

    STORAGE_PLUGINS = {"mcap": Mcap, "sqlite3": Sqlite}  # noqa: RUF012

    def open(self) -> None:
        """Open it. Raises InputError for anything that ROS does not write."""
        folder = Path(str(self.path))
        for one in folder.iterdir():
            if not (one.is_file() or one.is_dir()):
                raise InputError(f"{one.name} in it is no file")
        described = folder / "metadata.yaml"
        if described.stat().st_size > MAX_METADATA:
            raise InputError("its metadata.yaml is larger than any")
        # anchors and aliases (&name, *name) let a small YAML file expand to a huge one
        if re.search(r"(^|[\s:,\[\-])[&*]\w", described.read_text(errors="replace")):
            raise InputError("its metadata.yaml repeats itself, as ROS writes none")
        super().open()
