"""Open ROS recordings: ROS 1 bags, and ROS 2 bags as a folder, .mcap or .db3.

Messages are read by the definitions that come with rosbags, never by those in the file, from which
rosbags would generate code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from rosbags import rosbag1
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from slam.errors import InputError
from slam.io.bags.decompression import limited_decompression
from slam.io.bags.safe_readers import Bag1, Folder, Mcap, Sqlite
from slam.io.bags.truncated import TruncatedBag1, TruncatedMcap
from slam.io.files import MCAP_MAGIC, ROS1_MAGIC, SQLITE_MAGIC, AnyPath, reading
from slam.io.one_line import one_line
from slam.io.warnings import WarningCounter

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
for _kind in ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"):  # ROS 1's, and that of old recordings
    ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", _kind))
Reader = Bag1 | Mcap | Sqlite | Folder
READERS: dict[bytes, type[Bag1] | type[Mcap] | type[Sqlite]] = {
    ROS1_MAGIC: Bag1,
    MCAP_MAGIC: Mcap,
    SQLITE_MAGIC: Sqlite,
}
TRUNCATED = {Bag1: TruncatedBag1, Mcap: TruncatedMcap}
REPAIR_COMMANDS = {Bag1: "rosbag reindex", Mcap: "mcap recover", Folder: "ros2 bag reindex"}


class Topic(NamedTuple):
    """A topic of a recording: its name, its type such as `sensor_msgs/msg/LaserScan`, and how many
    messages it has."""

    name: str
    kind: str
    messages: int


class Bag:
    """An open recording.

    topics   by name
    ros      1 or 2
    seconds  from the first message to the last
    """

    def __init__(self, path: AnyPath, reader: Reader, warnings: WarningCounter) -> None:
        self.path = path
        self.warnings = warnings
        self.ros = 1 if isinstance(reader, rosbag1.Reader) else 2
        self._reader = reader
        self._read: Callable[[bytes, str], Any] = (
            ROS1.deserialize_ros1 if self.ros == 1 else ROS2.deserialize_cdr
        )
        span = reader if isinstance(reader, rosbag1.Reader) else reader.metadata
        self.seconds = max(span.end_time - span.start_time, 0) * 1e-9
        self._connections: dict[str, list[Connection]] = {}
        for one in sorted(reader.connections, key=lambda one: -one.msgcount):
            if not isinstance(one.topic, str):
                raise ValueError(f"a topic named {one.topic!r}")
            group = self._connections.setdefault(one.topic, [one])
            if one is not group[0] and one.msgtype == group[0].msgtype:
                group.append(one)
        self.topics = {
            name: Topic(name, group[0].msgtype, sum(one.msgcount for one in group))
            for name, group in sorted(self._connections.items())
        }

    def named(self, *kinds: str) -> list[str]:
        """The topics of the given types that have a message."""
        return [one.name for one in self.topics.values() if one.kind in kinds and one.messages]

    def messages(self, names: list[str]) -> Iterator[tuple[str, float, Any]]:
        """Topic, time of reception (s), and message; one that cannot be read is skipped and
        counted in the warnings."""
        wanted = [one for name in names for one in self._connections[name]]
        number = 0
        try:
            for number, (connection, time, data) in enumerate(self._reader.messages(wanted), 1):
                try:
                    message = self._read(data, connection.msgtype)
                except Exception:  # a damaged message can raise anything
                    kind = f"{one_line(connection.topic, 60)}: no {connection.msgtype}, left out"
                    self.warnings.add(kind, number)
                    continue
                yield connection.topic, time * 1e-9, message
        except InputError as error:
            raise InputError(f"{self.path}: {error}") from None
        except Exception as error:  # a damaged file too
            if not number:
                raise InputError(f"{self.path}: damaged ({one_line(error)})") from None
            self.warnings.add(f"file damaged ({one_line(error)}), the part before used", number)


@contextmanager
def open_bag(path: AnyPath, warnings: WarningCounter) -> Iterator[Bag]:
    """A recording open for reading; of a truncated one the readable part, with a warning.

    Raises InputError if the file is damaged or not a recording.
    """
    reader = _reader(Path(path))
    with limited_decompression(_size(Path(path))), ExitStack() as stack:
        try:
            bag = _bag(path, reader, warnings, stack)
        except InputError as error:
            raise InputError(f"{path}: {one_line(error)}") from None
        except Exception as error:
            truncated = _truncated(path, reader, warnings, stack)
            if truncated is None:
                raise InputError(f"{path}: {_not_readable(error, reader)}") from None
            bag = truncated
        yield bag


def _bag(path: AnyPath, reader: Reader, warnings: WarningCounter, stack: ExitStack) -> Bag:
    reader.open()
    stack.callback(_close, reader)
    return Bag(path, reader, warnings)


def _truncated(
    path: AnyPath, broken: Reader, warnings: WarningCounter, stack: ExitStack
) -> Bag | None:
    """The part of a recording that can be read without an index; None if there is none."""
    kind = TRUNCATED.get(type(broken))
    if kind is None:
        return None
    try:
        bag = _bag(path, kind(broken.path), warnings, stack)
    except Exception:
        return None
    number = sum(topic.messages for topic in bag.topics.values())
    if not number:
        return None
    warnings.add("recording cut off, the part before used", number)
    return bag


def _close(reader: Reader) -> None:
    with suppress(Exception):
        reader.close()


def _reader(path: Path) -> Reader:
    if path.is_dir():
        if (path / "metadata.yaml").is_file():
            return Folder(path)
        files = [one for one in path.iterdir() if one.suffix in (".mcap", ".db3")]
        if len(files) == 1:
            return _reader(files[0])  # no metadata.yaml: the recorder was killed
        raise InputError(
            f"{path}: no metadata.yaml in it, as a ROS 2 bag has; `ros2 bag reindex` writes it"
        )
    with reading(path) as file:
        head = file.read(16)
    for start, kind in READERS.items():
        if head.startswith(start):
            return kind(path)
    raise InputError(f"{path}: no ROS bag, MCAP or SQLite file")


def _size(path: Path) -> int:
    if not path.is_dir():
        return path.stat().st_size
    return sum(one.stat().st_size for one in path.iterdir() if one.is_file())


def _not_readable(error: Exception, reader: Reader) -> str:
    why = f"cannot be read as a ROS recording ({one_line(error, 150)})"
    command = REPAIR_COMMANDS.get(type(reader))
    return f"{why}; if it was cut off, `{command}` may mend it" if command else why
